"""Impulse coupling: the meso model carries the interface; the macro force acts on it by one impulse per window.

This is r-RESPA (M. Tuckerman, B. J. Berne, G. J. Martyna, J. Chem. Phys. 97, 1992, 1990-2001) and the mirror image of
held velocity. The interface, with the mass of both models, receives DT times the macro force at t_n, then m substeps of
the meso model; the macro model adopts the new interface position. All impulses are pairwise opposite, so linear and
angular momentum are conserved to round-off for any path-dependent material. The models alternate. The scheme is stable
under the conditions of held velocity.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.coupling.held_velocity import WindowMotion, counted_interface, local_interface
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.participant import Restartable
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.checkpoint_state import Rows, State
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.exchange import InterfaceChannels


class Impulse:
    """Impulse scheme; the macro model is created first and sends its interface mass."""

    order: tuple[Role, Role] = ("macro", "meso")

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "ImpulseMacro":
        """Return the participant of the macro model."""
        return ImpulseMacro(body, loads, plan, channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "ImpulseMeso":
        """Return the participant of the meso model."""
        return ImpulseMeso(body, loads, plan, channels)


class ImpulseMacro(Restartable):
    """Macro model: one step per window, with its interface moved by the meso model."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Send the mass of the interface and start at rest."""
        channels.velocities.send(np.repeat(body.mass[:, None], 3, axis=1))
        self.motion = ExplicitMotion(body, loads, plan.window, local_interface(body), np.zeros(len(body.mass)))
        self.plan, self._channels = plan, channels
        self._counted = counted_interface(body)
        self._zero, self._interface_force = np.zeros_like(self.motion.force), np.zeros_like(self.motion.force)
        self.interface_work = 0.0

    def begin_window(self) -> None:
        """Do nothing: the meso model already has the force."""

    def finish_window(self) -> None:
        """Receive the mean interface velocity, move, and send the interface force."""
        motion = self.motion
        before = motion.force[self._counted]
        self._channels.forces.receive(motion.velocity)
        motion.advance()
        motion.update_force()
        impulse = 0.5 * motion.step * (before + motion.force[self._counted])
        self.interface_work += float(np.sum(impulse * motion.velocity[self._counted]))
        self._channels.velocities.send(motion.force)

    def interface_force(self) -> NDArray[np.float64]:
        """Return the force sent to the meso model."""
        self._interface_force[self._counted] = self.motion.force[self._counted]
        return self._interface_force

    def foreign_force(self) -> NDArray[np.float64]:
        """Return zero: all forces belong to this model."""
        return self._zero


class ImpulseMeso(Restartable):
    """Meso model of joints, package, buffer and interface: m substeps per window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Receive the macro model's mass at the interface and start at rest; a ``ImpulseMacro`` must have sent it."""
        mass = np.zeros((len(body.mass), 3))
        channels.velocities.receive(mass)
        self.motion = WindowMotion(body, loads, plan, np.empty(0, np.int32), mass[:, 0].copy())
        self.plan, self._channels = plan, channels
        self._interface, self._counted = local_interface(body), counted_interface(body)
        self._received, self._mean = np.zeros_like(mass), np.zeros_like(mass)
        self.interface_work = 0.0

    def begin_window(self) -> None:
        """Take m substeps, the first with the macro force, then send the mean interface velocity."""
        motion = self.motion
        start = motion.displacement[self._interface]
        for substep in range(self.plan.substeps):
            motion.advance()
            if substep == 0:
                self._count_work()
            motion.update_force()
        self._mean[self._interface] = (motion.displacement[self._interface] - start) / self.plan.window
        self._channels.forces.send(self._mean)

    def finish_window(self) -> None:
        """Receive the macro force, and add the impulse of a window to one substep."""
        self._channels.velocities.receive(self._received)
        self.motion.force += self.foreign_force()
        self._count_work()

    def _count_work(self) -> None:
        """Add half a window's work of the macro force at the velocity of an adjacent substep."""
        work = np.sum(self._received[self._counted] * self.motion.velocity[self._counted])
        self.interface_work += 0.5 * self.plan.window * float(work)

    def interface_force(self) -> NDArray[np.float64]:
        """Return the received force."""
        return self._received

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the received force times the number of substeps, which is part of ``motion.force`` after a window."""
        return self.plan.substeps * self._received

    def state(self) -> State:
        """Return the motion, the interface work and the received force."""
        return {**super().state(), "received": Rows(self.motion.body.local.nodes, self._received)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned."""
        super().restore(state)
        self._received[:] = state["received"]
