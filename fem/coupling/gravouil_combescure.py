"""Gravouil and Combescure: equal velocities at the interface at every substep, by forces; for models without a buffer.

The interface is the macro nodes that the joints are tied to; the meso model has copies of them, which weigh what the
joints rest on them, rowsum(N^T M N). So both models have the interface's velocities as unknowns of their own, and the
operator of the link is diagonal. A window: the macro model moves and computes its force, which gives the velocity that
its interface would have without the link; the meso model's substep j solves

    (dt / 2 m_meso + DT / 2 m_macro) link_j = (1 - j/m) v_free(t_n) + (j/m) v_free(t_{n+1}) - v_meso_free,j

and the macro model gets -link_m. Any ratio of steps is stable as long as each model's own is: the interface takes
(m sum |link_j - link_{j-1}|^2 - |link_m - link_0|^2) / 2 / m_macro of the energy of the accelerations, never less than
zero (A. Gravouil, A. Combescure, Int. J. Numer. Meth. Engng 50, 2001, 199-225). That holds for v_free of t_n taken with
the link of t_n added, and for path-dependent forces in that the link never looks back.

Velocities are equal, displacements only to second order in DT: sum dt link_j is not DT times the mean of both ends, by
2 m_macro / DT times the change of the gap (``test_fem_gravouil_combescure``).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.coupling.held_velocity import Answered, local_interface
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.participant import Restartable, explicit_motion
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.kernels.motion import link_velocities
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.checkpoint_state import Rows, State
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.exchange import InterfaceChannels


class GravouilCombescure:
    """The scheme: the meso model waits for the macro model's mobility at the interface, so that one is made first."""

    order: tuple[Role, Role] = ("macro", "meso")

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "LinkedMacro":
        """Return the macro model's participant."""
        return LinkedMacro(explicit_motion(body, loads, plan.window), plan, channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "LinkedMeso":
        """Return the meso model's participant."""
        return LinkedMeso(explicit_motion(body, loads, plan.step), plan, channels)


class LinkedMacro(Answered):
    """The board: one step a window, then as long as the meso model takes."""

    def __init__(self, motion: ExplicitMotion, plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Send the mobility of the interface."""
        super().__init__(motion, plan, channels)
        self._interface = local_interface(motion.body)
        self._free = np.zeros_like(motion.velocity)
        channels.velocities.send(motion.mobility)

    def begin_window(self) -> None:
        """Move, compute the force, and send the velocity that the interface has without the link."""
        motion, nodes = self.motion, self._interface
        motion.advance()
        motion.update_force()
        self._free[nodes] = motion.velocity[nodes] + 0.5 * motion.step * motion.acceleration(nodes)
        self._channels.velocities.send(self._free)

    def finish_window(self) -> None:
        """Receive the link's force."""
        self.take_force()


class LinkedMeso(Restartable):
    """Joints and package on copies of the macro nodes: m substeps a window, each with its link."""

    motion: ExplicitMotion

    def __init__(self, motion: ExplicitMotion, plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Receive the mobility of the interface; a ``LinkedMacro`` must have sent it."""
        self.motion, self.plan, self._channels = motion, plan, channels
        self.interface_work = 0.0
        self._link = np.zeros_like(motion.force)
        self._arrived = np.zeros_like(motion.force)
        channels.velocities.receive(self._arrived)
        self._interface = local_interface(motion.body)
        self._yield, self._terms, self._held = self._link_terms()
        for component in range(3):
            motion.hold(self._interface[self._held[:, component]], component)

    def _link_terms(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Return the macro model's part of the compliance, ``link_velocities``' terms, and what it prescribes."""
        motion, half = self.motion, 0.5 * self.plan.step
        other, own = self._arrived[self._interface], motion.mobility[self._interface]
        given = 0.5 * self.plan.window * other
        linked = (other > 0.0) & (own > 0.0)
        compliance = np.where(linked, given + half * own, np.inf)
        weight = half * np.repeat(motion.body.shared.owned[self._interface, None], 3, axis=1)
        return given, np.stack([half * own, compliance, np.zeros_like(own), weight]), other == 0.0

    def begin_window(self) -> None:
        """Take m substeps, linked to the macro model's velocity; then send the last link's force."""
        motion, interface, count = self.motion, self._interface, self.plan.substeps
        start = (
            motion.velocity[interface]
            + 0.5 * motion.step * motion.acceleration(interface)
            + self._yield * self._link[interface]
        )
        self._channels.velocities.receive(self._arrived)
        change = self._arrived[interface] - start
        motion.velocity[interface] = np.where(self._held, self._arrived[interface], motion.velocity[interface])
        for j in range(1, count + 1):
            motion.advance()
            motion.update_force()
            self._terms[2] = start + (j / count) * change - 0.5 * motion.step * motion.gravity
            self.interface_work += link_velocities(interface, motion.velocity, motion.force, self._terms, self._link)
        self._channels.forces.send(-self._link)

    def finish_window(self) -> None:
        """Do nothing: the window is done."""

    def interface_force(self) -> NDArray[np.float64]:
        """Return the force that was sent."""
        return -self._link

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the link's force: it is in ``motion.force``."""
        return self._link

    def state(self) -> State:
        """Return also the link."""
        return {**super().state(), "link": Rows(self.motion.body.local.nodes, self._link)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from the values of what ``state`` returned."""
        super().restore(state)
        self._link[:] = state["link"]
