"""Held-velocity coupling: constant macro velocity at the interface over a window, meso force returned at its end.

A window, with the interface two layers of elements inside the board:
macro: a_n = (F_ext + F_c - F_int) / (M + M_interface) -> v^{n+1/2}, U^{n+1}; the interface velocity v^{n+1/2} is sent
to the meso model, which takes m substeps with it while the macro model computes F_int(U^{n+1}); then the force
F_c = -(K u)_c is returned.
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
from reflowshock.fem.loads.damping import WindowDrag
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.checkpoint_state import Rows, State
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.exchange import InterfaceChannels


class HeldVelocity:
    """Held-velocity scheme; the meso model is created first and sends its interface mass."""

    order: tuple[Role, Role] = ("meso", "macro")

    def macro(
        self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels
    ) -> "HeldVelocityMacro":
        """Return the participant of the macro model."""
        return HeldVelocityMacro(body, loads, plan, channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "HeldVelocityMeso":
        """Return the participant of the meso model."""
        return HeldVelocityMeso(body, loads, plan, channels)


class ForceReceiver(Restartable):
    """Macro model that takes one step per window and receives an interface force."""

    motion: ExplicitMotion

    def __init__(self, motion: ExplicitMotion, plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Wrap a motion whose step is the window."""
        self.motion, self.plan, self._channels = motion, plan, channels
        self._received = np.zeros_like(motion.force)
        self._interface, self._counted = local_interface(motion.body), counted_interface(motion.body)
        self.interface_work = 0.0

    def take_force(self) -> None:
        """Receive the force of the meso model, and add the work across the interface."""
        motion, counted, half = self.motion, self._counted, 0.5 * self.motion.step
        impulse = np.zeros((len(counted), 3))
        add_impulse(counted, self._received, half, impulse)
        self._channels.forces.receive(self._received)
        add_impulse(counted, self._received, half, impulse)
        add_rows(self._interface, self._received, motion.force)
        self.interface_work -= float(np.vdot(impulse, motion.velocity[counted]))

    def interface_force(self) -> NDArray[np.float64]:
        """Return the received interface force."""
        return self._received

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the received force, which is part of ``motion.force``."""
        return self._received

    def state(self) -> State:
        """Return the motion, the interface work and the received force."""
        return {**super().state(), "received": Rows(self.motion.body.local.nodes, self._received)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned."""
        super().restore(state)
        self._received[:] = state["received"]


class HeldVelocityMacro(ForceReceiver):
    """Macro model: one step per window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Receive the interface mass and start at rest; a ``HeldVelocityMeso`` must have sent it."""
        mass = np.zeros((len(body.mass), 3))
        channels.forces.receive(mass)
        super().__init__(
            ExplicitMotion(body, loads, plan.window, np.empty(0, np.int32), mass[:, 0].copy()), plan, channels
        )

    def begin_window(self) -> None:
        """Move, and send the interface velocity."""
        self.motion.advance()
        self._channels.velocities.send(self.motion.velocity)

    def finish_window(self) -> None:
        """Compute the force, and receive the force of the meso model."""
        self.motion.update_force()
        self.take_force()


class WindowMotion(ExplicitMotion):
    """Motion with substeps whose body accelerations match a model that takes whole windows.

    All substeps of a window use the acceleration at its start. The first substep also gets (m - 1) / 2 times the change
    since the previous window, so that the mean velocity of the window equals the velocity of the other model, and both
    models stay together in free fall.
    """

    def __init__(
        self,
        body: Body,
        loads: list[Load],
        plan: WindowPlan,
        held: NDArray[np.integer],
        extra_mass: NDArray[np.float64],
    ) -> None:
        """Start at rest; ``held`` and ``extra_mass`` are as in ``ExplicitMotion``."""
        self._substeps, self._cached = plan.substeps, (np.nan, np.zeros(3))
        super().__init__(body, loads, plan.step, held, extra_mass)

    def body_acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the acceleration of the substep that begins at a time [s], shape (3,) [m/s^2]."""
        now = self.window_acceleration(time)
        if round(time / self.step) % self._substeps:
            return now
        return self._first_of_window(self.window_acceleration(max(time - self._substeps * self.step, 0.0)), now)

    def accelerations(self, times: Sequence[float]) -> NDArray[np.float64]:
        """Return the acceleration at the end of each substep of a window, shape (m, 3); only the last one differs."""
        result = np.empty((len(times), 3))
        result[:] = self.window_acceleration(self.time)
        result[-1] = self._first_of_window(result[0], self.window_acceleration(times[-1]))
        return result

    def _first_of_window(self, before: NDArray[np.float64], now: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the acceleration of the first substep, shape (3,), from the accelerations of two windows [m/s^2]."""
        return now + 0.5 * (self._substeps - 1) * (now - before)

    def window_acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the body acceleration at the start of the window of a time [s], shape (3,) [m/s^2]."""
        begin = time - round(time / self.step) % self._substeps * self.step
        if begin != self._cached[0]:  # evaluated several times per window
            self._cached = begin, super().body_acceleration(begin)
        return self._cached[1]


class VelocityFollower(Restartable):
    """Meso model whose interface moves at the velocity of the macro model."""

    motion: WindowMotion

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Start at rest."""
        self._channels = channels
        loads = WindowDrag.once_a_window(loads, plan.substeps)
        self.motion = WindowMotion(body, loads, plan, local_interface(body), np.zeros(len(body.mass)))
        self.plan = plan
        self.interface_work = 0.0
        self._interface, self._counted = local_interface(body), counted_interface(body)
        owned = body.shared.owned[self._interface]
        self._owned = slice(None) if owned.all() else owned
        self._zero = np.zeros((len(body.mass), 3))
        self._lags = plan.step * (np.arange(plan.substeps) - 0.5 * (plan.substeps - 1))
        ends = 0.5 * plan.step * np.ones(2)  # the work of a substep uses the mean of the forces at both ends
        self._weights = np.column_stack([np.convolve(np.ones(plan.substeps), ends), np.convolve(self._lags, ends)])

    def follow(self) -> float:
        """Take m substeps at the received interface velocity, and return the work received across the interface [J].

        Inside the window the interface follows the body acceleration, and ends at the position of the macro model.
        """
        motion, counted = self.motion, self._counted
        self._channels.velocities.receive(motion.velocity)
        velocity, acceleration = motion.velocity[self._interface], motion.window_acceleration(motion.time)
        change, impulses = self._lags[:, None] * acceleration, np.zeros((2, len(counted), 3))
        motion.take_steps(
            self.plan.substeps, Interface(self._interface, counted, velocity, change, self._weights, impulses)
        )
        impulse, lagging = impulses
        lag = lagging.sum(axis=0) @ acceleration if acceleration.any() else 0.0
        return -float(np.vdot(impulse, velocity[self._owned]) + lag)

    def finish_window(self) -> None:
        """Do nothing: ``begin_window`` has finished the window."""

    def foreign_force(self) -> NDArray[np.float64]:
        """Return zero: all forces belong to this model."""
        return self._zero


class HeldVelocityMeso(VelocityFollower):
    """Meso model of joints, package and upper board layers: m substeps per window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Send the interface mass and start at rest."""
        channels.forces.send(np.repeat(body.mass[:, None], 3, axis=1))
        super().__init__(body, loads, plan, channels)
        self._interface_force = np.zeros((len(body.mass), 3))

    def begin_window(self) -> None:
        """Take m substeps, then send the interface force."""
        self.interface_work += self.follow()
        self._channels.forces.send(self.motion.force)

    def interface_force(self) -> NDArray[np.float64]:
        """Return the force sent to the macro model."""
        self._interface_force[self._counted] = self.motion.force[self._counted]
        return self._interface_force


def local_interface(body: Body) -> NDArray[np.int32]:
    """Return the local numbers of the interface nodes on this rank, shape (k,).

    Interface nodes are shared by macro and meso model; the order is the same in both.

    Args:
        body: Model on this rank.
    """
    return body.interface[body.interface >= 0]


def counted_interface(body: Body) -> NDArray[np.int32]:
    """Return the local numbers of the interface nodes that this rank owns, shape (k,), each on one rank only.

    Interface nodes are shared by macro and meso model.

    Args:
        body: Model on this rank.
    """
    nodes = local_interface(body)
    return nodes[body.shared.owned[nodes]]
