"""Impulses: the meso model carries the interface in its own steps; the macro model's force pushes it once a window.

A window is one of r-RESPA (M. Tuckerman, B. J. Berne, G. J. Martyna, J. Chem. Phys. 97, 1992, 1990-2001), mirror image
of held velocity: the interface, which weighs what both models have there, gets DT times the macro model's force at t_n,
then m substeps of the meso model's; the macro model moves with where the interface has come to. Every element pushes
its nodes by opposite impulses, so linear and angular momentum are kept to round-off, along any path of the meso model's
material. The models wait for each other. Stable under the conditions of held velocity.
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
    """The scheme: the meso model waits for the macro model's mass at the interface, so that one is made first."""

    order: tuple[Role, Role] = ("macro", "meso")

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "ImpulseMacro":
        """Return the macro model's participant."""
        return ImpulseMacro(body, loads, plan, channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "ImpulseMeso":
        """Return the meso model's participant."""
        return ImpulseMeso(body, loads, plan, channels)


class ImpulseMacro(Restartable):
    """The board: one step a window, its interface where the meso model has taken it."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Send the mass of the interface and start at rest."""
        channels.velocities.send(np.repeat(body.mass[:, None], 3, axis=1))
        self.motion = ExplicitMotion(body, loads, plan.window, local_interface(body), np.zeros(len(body.mass)))
        self.plan, self._channels = plan, channels
        self._counted = counted_interface(body)
        self._zero, self._interface_force = np.zeros_like(self.motion.force), np.zeros_like(self.motion.force)
        self.interface_work = 0.0

    def begin_window(self) -> None:
        """Do nothing: the meso model has the force."""

    def finish_window(self) -> None:
        """Receive the interface's mean velocity, move, and send the force at the interface."""
        motion = self.motion
        before = motion.force[self._counted]
        self._channels.forces.receive(motion.velocity)
        motion.advance()
        motion.update_force()
        impulse = 0.5 * motion.step * (before + motion.force[self._counted])
        self.interface_work += float(np.sum(impulse * motion.velocity[self._counted]))
        self._channels.velocities.send(motion.force)

    def interface_force(self) -> NDArray[np.float64]:
        """Return the force that was sent."""
        self._interface_force[self._counted] = self.motion.force[self._counted]
        return self._interface_force

    def foreign_force(self) -> NDArray[np.float64]:
        """Return zero: all forces are this model's."""
        return self._zero


class ImpulseMeso(Restartable):
    """Joints, package, buffer and the interface itself: m substeps a window."""

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
        """Take m substeps, the first of which feels the macro model's force; send the interface's mean velocity."""
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
        """Receive the macro model's force, an impulse of a window for one substep."""
        self._channels.velocities.receive(self._received)
        self.motion.force += self.foreign_force()
        self._count_work()

    def _count_work(self) -> None:
        """Add half a window's work of the macro model's force at the velocity of a substep beside it."""
        work = np.sum(self._received[self._counted] * self.motion.velocity[self._counted])
        self.interface_work += 0.5 * self.plan.window * float(work)

    def interface_force(self) -> NDArray[np.float64]:
        """Return the received force."""
        return self._received

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the received force as often as there are substeps: it is in ``motion.force`` after a window."""
        return self.plan.substeps * self._received

    def state(self) -> State:
        """Return also the received force."""
        return {**super().state(), "received": Rows(self.motion.body.local.nodes, self._received)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the values of what ``state`` returned."""
        super().restore(state)
        self._received[:] = state["received"]
