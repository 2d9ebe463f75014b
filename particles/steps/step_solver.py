"""What solves for the motion in a time step: a member of this family for each way to treat pressure and inertia."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.physics.physics import Physics


@dataclass(frozen=True, slots=True)
class Motion:
    """What happens in a time step.

    Attributes:
        velocity: `(n, 3)` of the particles at the end [m/s].
        transport: `(n, 3)` their mean velocity, which takes them where they go [m/s].
        pressure: `(n,)` above the ambient pressure [Pa].
        surface_pressure: pressure that carries the volume constraint [Pa].
        twists: `(6,)` of each plate that moves, by its index [m/s, rad/s].
        iterations: of the pressure solve.
        drift: `(n, 3)` rigid motion that nothing ends, on smooth walls [m/s]; None where there is none.
        pull: mean force on a plate that is moved, along its way [N]; not a number where none is, or it is not known.
    """

    velocity: Floats
    transport: Floats
    pressure: Floats
    surface_pressure: float
    twists: dict[int, Floats]
    iterations: int
    drift: Floats | None = None
    pull: float = float("nan")

    @property
    def top_speed(self) -> float:
        """Mean speed of the fastest particle [m/s]."""
        return float(np.sqrt((self.transport**2).sum(axis=1).max()))


class PreparedStep(Protocol):
    """A step from the body's current positions, for any size."""

    def solve(self, time_step: float, volume: float) -> Motion:
        """Return the motion in a time step [s] that ends at a volume [m^3].

        Raises:
            SolveFailed: the linear solve failed.
        """


@dataclass(frozen=True, slots=True)
class SolverTraits:
    """What a flow has to know of a solver.

    Attributes:
        support: radius of the neighbour list that it needs, in spacings.
        smoothing_passes: how often the triangles are evened out after a step; less than once where it is done in part.
        flip_worth: angle [rad] beyond Delaunay's for which a flip may even out the numbers of triangles at a vertex.
        descends: whether a short enough step without momentum lowers the energy.
        keeps_time: whether a motion takes its physical time; else only where it leads to counts.
        flaw: why the scheme itself breaks, for the message when it does; None where it holds.
    """

    support: float
    smoothing_passes: float = 1.0
    flip_worth: float = 0.0
    descends: bool = False
    keeps_time: bool = True
    flaw: str | None = None


class StepSolver(Protocol):
    """How a step is solved."""

    @property
    def traits(self) -> SolverTraits:
        """What a flow has to know of it."""

    def prepare(self, body: Body, physics: Physics, neighbours: NeighbourList) -> PreparedStep:
        """Build what does not depend on the size of the step."""

    def saved(self) -> dict[str, Any]:
        """What it remembers of earlier steps, for a checkpoint."""

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
