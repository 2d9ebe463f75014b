"""One-way coupling (submodelling): the macro model drives the interface of the meso model and receives no force.

The macro model is a complete structure with a coarse mesh of the fine region. In the energy balance of the meso model,
the work across the interface is external work.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.coupling.held_velocity import VelocityFollower
from reflowshock.fem.dynamics.participant import SingleModel, explicit_motion
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.loads.load import Checkpointed, Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.exchange import InterfaceChannels


class OneWay:
    """One-way scheme; the participants are created in any order."""

    order: tuple[Role, Role] = ("macro", "meso")

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "Driver":
        """Return the participant of the macro model."""
        return Driver(body, loads, plan, channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "Submodel":
        """Return the participant of the meso model."""
        return Submodel(body, loads, plan, channels)


class Driver(SingleModel):
    """Macro model of the whole structure: one step per window, sending its interface velocity."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Start at rest."""
        super().__init__(explicit_motion(body, loads, plan.window), plan)
        self._channels = channels

    def begin_window(self) -> None:
        """Move, and send the interface velocity."""
        self.motion.advance()
        self._channels.velocities.send(self.motion.velocity)

    def finish_window(self) -> None:
        """Compute the force."""
        self.motion.update_force()


@dataclass
class InterfaceWork(Load):
    """Work that moves the interface of a submodel [J]."""

    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {"work": "sum"}
    work: float = 0.0


class Submodel(VelocityFollower):
    """Meso model of the fine region: m substeps per window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Start at rest."""
        self._work = InterfaceWork()
        super().__init__(body, [*loads, self._work], plan, channels)

    def begin_window(self) -> None:
        """Take m substeps."""
        self._work.work += self.follow()

    def interface_force(self) -> NDArray[np.float64]:
        """Return zero: the macro model receives no interface force."""
        return self._zero
