"""Gravouil-Combescure coupling: equal interface velocities at every substep by Lagrange multipliers (links).

The interface consists of the macro nodes that the joints are tied to; the meso model has copies of them with the mass
of the joints tied to them, rowsum(N^T M N). Both models therefore have interface velocities of their own, and the
operator of the link is diagonal. In a window, the macro model moves and computes its force, which gives its interface
velocity without the link. Substep j of the meso model then solves

    (dt / 2 m_meso + DT / 2 m_macro) link_j = (1 - j/m) v_free(t_n) + (j/m) v_free(t_{n+1}) - v_meso_free,j

and the macro model receives -link_m. Every step ratio is stable if both models are: the interface dissipates
(m sum |link_j - link_{j-1}|^2 - |link_m - link_0|^2) / 2 / m_macro >= 0 of the energy of the accelerations (A.
Gravouil, A. Combescure, Int. J. Numer. Meth. Engng 50, 2001, 199-225), where v_free(t_n) includes the link of t_n. The
scheme needs no buffer and supports path-dependent forces.

Velocities are equal, displacements only to second order in DT: sum dt link_j differs from DT times the mean of both
ends by 2 m_macro / DT times the change of the gap (``test_fem_gravouil_combescure``).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.coupling.held_velocity import ForceReceiver, local_interface
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
    """Gravouil-Combescure scheme; the macro model is created first and sends its interface mobility."""

    order: tuple[Role, Role] = ("macro", "meso")

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "LinkedMacro":
        """Return the participant of the macro model."""
        return LinkedMacro(explicit_motion(body, loads, plan.window), plan, channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "LinkedMeso":
        """Return the participant of the meso model."""
        return LinkedMeso(explicit_motion(body, loads, plan.step), plan, channels)


class LinkedMacro(ForceReceiver):
    """Macro model: one step per window, then it waits for the link of the meso model."""

    def __init__(self, motion: ExplicitMotion, plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Send the mobility of the interface."""
        super().__init__(motion, plan, channels)
        self._interface = local_interface(motion.body)
        self._free = np.zeros_like(motion.velocity)
        channels.velocities.send(motion.mobility)

    def begin_window(self) -> None:
        """Move, compute the force, and send the interface velocity without the link."""
        motion, nodes = self.motion, self._interface
        motion.advance()
        motion.update_force()
        self._free[nodes] = motion.velocity[nodes] + 0.5 * motion.step * motion.acceleration(nodes)
        self._channels.velocities.send(self._free)

    def finish_window(self) -> None:
        """Receive the force of the link."""
        self.take_force()


class LinkedMeso(Restartable):
    """Meso model on copies of the macro nodes: m substeps per window, each with its link."""

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
        """Return macro compliance, terms of ``link_velocities``, and components prescribed by the macro model."""
        motion, half = self.motion, 0.5 * self.plan.step
        macro_mobility, mobility = self._arrived[self._interface], motion.mobility[self._interface]
        macro_compliance = 0.5 * self.plan.window * macro_mobility
        linked = (macro_mobility > 0.0) & (mobility > 0.0)
        compliance = np.where(linked, macro_compliance + half * mobility, np.inf)
        weight = half * np.repeat(motion.body.shared.owned[self._interface, None], 3, axis=1)
        terms = np.stack([half * mobility, compliance, np.zeros_like(mobility), weight])
        return macro_compliance, terms, macro_mobility == 0.0

    def begin_window(self) -> None:
        """Take m substeps linked to the macro velocity, then send the force of the last link."""
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
        """Do nothing: ``begin_window`` has finished the window."""

    def interface_force(self) -> NDArray[np.float64]:
        """Return the force sent to the macro model."""
        return -self._link

    def foreign_force(self) -> NDArray[np.float64]:
        """Return the link, which is part of ``motion.force``."""
        return self._link

    def state(self) -> State:
        """Return the motion, the interface work and the link."""
        return {**super().state(), "link": Rows(self.motion.body.local.nodes, self._link)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned."""
        super().restore(state)
        self._link[:] = state["link"]
