"""One way: the macro model drives the meso model's cut and takes nothing back, as a submodel is driven.

The macro model is a whole structure of its own, the fine region coarsely included; its windows are those of one model
alone. The meso model's ledger balances with the work across its cut, which to it is external.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.coupling.held_velocity import Driven
from reflowshock.fem.dynamics.participant import Alone, uncut_motion
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.loads.load import Kept, Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.exchange import CutChannels


class OneWay:
    """The scheme: nobody waits for anything at the start."""

    order: tuple[Role, Role] = ("macro", "meso")

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: CutChannels) -> "Driver":
        """Return the macro model's participant."""
        return Driver(body, loads, plan, channels)

    def meso(self, body: Body, loads: list[Load], plan: WindowPlan, channels: CutChannels) -> "Submodel":
        """Return the meso model's participant."""
        return Submodel(body, loads, plan, channels)


class Driver(Alone):
    """The whole structure: one step a window, whose velocity at the cut is told."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: CutChannels) -> None:
        """Start at rest."""
        super().__init__(uncut_motion(body, loads, plan.window), plan)
        self._channels = channels

    def begin_window(self) -> None:
        """Move, and send the cut's velocity."""
        self.motion.advance()
        self._channels.velocities.send(self.motion.velocity)

    def finish_window(self) -> None:
        """Compute the force."""
        self.motion.update_force()


@dataclass
class CutWork(Load):
    """The work that moves the cut of a submodel [J]."""

    kept: ClassVar[Mapping[str, Kept]] = {"work": "sum"}
    work: float = 0.0


class Submodel(Driven):
    """The fine region: m substeps a window."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: CutChannels) -> None:
        """Start at rest."""
        self._work = CutWork()
        super().__init__(body, [*loads, self._work], plan, channels)

    def begin_window(self) -> None:
        """Take m substeps."""
        self._work.work += self.follow()

    def cut_force(self) -> NDArray[np.float64]:
        """Return zero: nobody takes the force of the cut."""
        return self._zero
