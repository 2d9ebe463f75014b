"""One way: the macro model drives the meso model's interface and takes nothing back, as a submodel is driven.

The macro model is a whole structure of its own, the fine region coarsely included; its windows are those of one model
alone. The meso model's energy balance balances with the work across its interface, which to it is external.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.coupling.held_velocity import Driven
from reflowshock.fem.dynamics.participant import SingleModel, explicit_motion
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.loads.load import Kept, Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.exchange import InterfaceChannels


class OneWay:
    """The scheme: nobody waits for anything at the start."""

    order: tuple[Role, Role] = ("macro", "meso")

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "Driver":
        """Return the macro model's participant."""
        return Driver(body, loads, plan, channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> "Submodel":
        """Return the meso model's participant."""
        return Submodel(body, loads, plan, channels)


class Driver(SingleModel):
    """The whole structure: one step a window, whose velocity at the interface is sent."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Start at rest."""
        super().__init__(explicit_motion(body, loads, plan.window), plan)
        self._channels = channels

    def begin_window(self) -> None:
        """Move, and send the interface's velocity."""
        self.motion.advance()
        self._channels.velocities.send(self.motion.velocity)

    def finish_window(self) -> None:
        """Compute the force."""
        self.motion.update_force()


@dataclass
class InterfaceWork(Load):
    """The work that moves the interface of a submodel [J]."""

    kept: ClassVar[Mapping[str, Kept]] = {"work": "sum"}
    work: float = 0.0


class Submodel(Driven):
    """The fine region: m substeps a window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Start at rest."""
        self._work = InterfaceWork()
        super().__init__(body, [*loads, self._work], plan, channels)

    def begin_window(self) -> None:
        """Take m substeps."""
        self._work.work += self.follow()

    def interface_force(self) -> NDArray[np.float64]:
        """Return zero: nobody takes the force of the interface."""
        return self._zero
