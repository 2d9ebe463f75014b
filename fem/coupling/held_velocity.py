"""Held velocity: the interface moves at the macro model's velocity over a window, the meso model's force comes back.

A window (the interface lies two layers of elements inside the board):
macro: a_n = (F_ext + F_c - F_int) / (M + M_interface) -> v^{n+1/2}, U^{n+1}; the interface's v^{n+1/2} goes to the meso
model, which takes m substeps with it WHILE the macro model computes F_int(U^{n+1}); F_c = -(K u)_c comes back last.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.participant import Restartable
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.kernels.levels import Interface
from reflowshock.fem.kernels.motion import add_impulse, add_rows
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.checkpoint_state import Rows, State
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.exchange import InterfaceChannels


class HeldVelocity:
    """The scheme: the macro model waits for the interface mass, so the meso model is made first."""

    order: tuple[Role, Role] = ("meso", "macro")

    def macro(
        self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels
    ) -> "HeldVelocityMacro":
        """Return the macro model's participant."""
        return HeldVelocityMacro(body, loads, plan, channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "HeldVelocityMeso":
        """Return the meso model's participant."""
        return HeldVelocityMeso(body, loads, plan, channels)


class Answered(Restartable):
    """A macro model that takes one step a window and gets a force at the interface back."""

    motion: ExplicitMotion

    def __init__(self, motion: ExplicitMotion, plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Take a motion that is ready to advance by windows."""
        self.motion, self.plan, self._channels = motion, plan, channels
        self._received = np.zeros_like(motion.force)
        self._interface, self._counted = local_interface(motion.body), counted_interface(motion.body)
        self.interface_work = 0.0

    def take_force(self) -> None:
        """Receive the meso model's force, and count the work across the interface."""
        motion, counted, half = self.motion, self._counted, 0.5 * self.motion.step
        impulse = np.zeros((len(counted), 3))
        add_impulse(counted, self._received, half, impulse)
        self._channels.forces.receive(self._received)
        add_impulse(counted, self._received, half, impulse)
        add_rows(self._interface, self._received, motion.force)
        self.interface_work -= float(np.vdot(impulse, motion.velocity[counted]))

    def interface_force(self) -> NDArray[np.float64]:
        """Return the received force at the interface."""
        return self._received

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the received force: it is in ``motion.force``."""
        return self._received

    def state(self) -> State:
        """Return also the received force."""
        return {**super().state(), "received": Rows(self.motion.body.local.nodes, self._received)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the values of what ``state`` returned."""
        super().restore(state)
        self._received[:] = state["received"]


class HeldVelocityMacro(Answered):
    """The board: one step a window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Receive the interface mass and start at rest; a ``HeldVelocityMeso`` must have sent it."""
        mass = np.zeros((len(body.mass), 3))
        channels.forces.receive(mass)
        super().__init__(
            ExplicitMotion(body, loads, plan.window, np.empty(0, np.int32), mass[:, 0].copy()), plan, channels
        )

    def begin_window(self) -> None:
        """Move, and send the interface's velocity."""
        self.motion.advance()
        self._channels.velocities.send(self.motion.velocity)

    def finish_window(self) -> None:
        """Compute the force, and receive the meso model's."""
        self.motion.update_force()
        self.take_force()


class WindowMotion(ExplicitMotion):
    """The motion of a model beside another one that takes whole windows: body accelerations push both alike.

    All substeps of a window are pushed as it begins, the first also by what makes the mean velocity of the window that
    of a step of the other model, (m - 1) / 2 times the change since the window before: in free fall the two never part.
    """

    def __init__(
        self,
        body: Body,
        loads: list[Load],
        plan: WindowPlan,
        held: NDArray[np.integer],
        extra_mass: NDArray[np.float64],
    ) -> None:
        """Start at rest; ``held`` and ``extra_mass`` as those of ``ExplicitMotion``."""
        self._substeps, self._known = plan.substeps, (np.nan, np.zeros(3))
        super().__init__(body, loads, plan.step, held, extra_mass)

    def body_acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the acceleration ``(3,)`` [m/s^2] of the substep that begins at a time [s]."""
        now = self.window_acceleration(time)
        if round(time / self.step) % self._substeps:
            return now
        return self._first_of_window(self.window_acceleration(max(time - self._substeps * self.step, 0.0)), now)

    def accelerations(self, times: Sequence[float]) -> NDArray[np.float64]:
        """Return the same at the ends of all substeps of a window: but for the last one it does not change."""
        found = np.empty((len(times), 3))
        found[:] = self.window_acceleration(self.time)
        found[-1] = self._first_of_window(found[0], self.window_acceleration(times[-1]))
        return found

    def _first_of_window(self, before: NDArray[np.float64], now: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the acceleration ``(3,)`` of a window's first substep from those of two windows [m/s^2]."""
        return now + 0.5 * (self._substeps - 1) * (now - before)

    def window_acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the sum of the loads' accelerations ``(3,)`` [m/s^2] as the window of a time [s] begins."""
        begin = time - round(time / self.step) % self._substeps * self.step
        if begin != self._known[0]:  # a window asks several times
            self._known = begin, super().body_acceleration(begin)
        return self._known[1]


class Driven(Restartable):
    """A meso model whose interface moves at the macro model's velocity."""

    motion: WindowMotion

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Start at rest."""
        self._channels = channels
        self.motion = WindowMotion(body, loads, plan, local_interface(body), np.zeros(len(body.mass)))
        self.plan = plan
        self.interface_work = 0.0
        self._interface, self._counted = local_interface(body), counted_interface(body)
        owned = body.shared.owned[self._interface]
        self._owned = slice(None) if owned.all() else owned
        self._zero = np.zeros((len(body.mass), 3))
        self._lags = plan.step * (np.arange(plan.substeps) - 0.5 * (plan.substeps - 1))
        ends = 0.5 * plan.step * np.ones(2)  # a substep's work is that of the mean force
        self._weights = np.column_stack([np.convolve(np.ones(plan.substeps), ends), np.convolve(self._lags, ends)])

    def follow(self) -> float:
        """Take m substeps at the received velocity of the interface; return the work that came in across it [J].

        Inside the window the interface falls as all else does, and ends where the macro model's is.
        """
        motion, counted = self.motion, self._counted
        self._channels.velocities.receive(motion.velocity)
        given, acceleration = motion.velocity[self._interface], motion.window_acceleration(motion.time)
        change, impulses = self._lags[:, None] * acceleration, np.zeros((2, len(counted), 3))
        motion.take_steps(
            self.plan.substeps, Interface(self._interface, counted, given, change, self._weights, impulses)
        )
        impulse, lagging = impulses
        lag = lagging.sum(axis=0) @ acceleration if acceleration.any() else 0.0
        return -float(np.vdot(impulse, given[self._owned]) + lag)

    def finish_window(self) -> None:
        """Do nothing: the window is done."""

    def foreign_force(self) -> NDArray[np.float64]:
        """Return zero: all forces are this model's."""
        return self._zero


class HeldVelocityMeso(Driven):
    """Joints, package and the uppermost board layers: m substeps a window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Send the interface mass and start at rest."""
        channels.forces.send(np.repeat(body.mass[:, None], 3, axis=1))
        super().__init__(body, loads, plan, channels)
        self._interface_force = np.zeros((len(body.mass), 3))

    def begin_window(self) -> None:
        """Take m substeps, then send the force of the interface."""
        self.interface_work += self.follow()
        self._channels.forces.send(self.motion.force)

    def interface_force(self) -> NDArray[np.float64]:
        """Return the force that was sent."""
        self._interface_force[self._counted] = self.motion.force[self._counted]
        return self._interface_force


def local_interface(body: Body) -> NDArray[np.int32]:
    """Return the interface nodes that this rank has, local numbers."""
    return body.interface[body.interface >= 0]


def counted_interface(body: Body) -> NDArray[np.int32]:
    """Return the local interface nodes that count on this rank: those that it owns."""
    here = local_interface(body)
    return here[body.shared.owned[here]]
