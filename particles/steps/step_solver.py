"""Interface of step solvers: each one treats pressure and inertia in its own way and returns a motion."""

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
    """Motion of a body in a time step.

    Attributes:
        velocity: Velocity at the end of the step, shape (n, 3) [m/s].
        transport: Mean velocity that moves the particles, shape (n, 3) [m/s].
        pressure: Pressure above ambient, shape (n,) [Pa].
        surface_pressure: Pressure that enforces the volume constraint [Pa].
        twists: Mean twist of each moving plate by its index, shape (6,) [m/s, rad/s].
        iterations: Number of iterations of the pressure solve.
        drift: Slow rigid-body motion on frictionless walls, which never ends, shape (n, 3) [m/s]; None without any.
        pull: Mean force on plates with prescribed motion, along it [N]; NaN if unknown or without such motion.
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
    """Step from the body's current positions, for any time step."""

    def solve(self, time_step: float, volume: float) -> Motion:
        """Compute the motion in a time step.

        Args:
            time_step: Time step [s].
            volume: Enclosed volume at the end of the step [m^3].

        Raises:
            SolveFailed: The linear solve failed.
        """


@dataclass(frozen=True, slots=True)
class SolverTraits:
    """Properties of a step solver that a flow uses.

    Attributes:
        support: Radius of the neighbour list, in spacings.
        smoothing_passes: Number of mesh smoothing passes after a step; below one, a pass is done in part.
        flip_worth: Angle beyond Delaunay for which a flip may balance the numbers of triangles at vertices [rad].
        descends: Whether a sufficiently short step without inertia lowers the energy.
        keeps_time: Whether the motion is physical in time; otherwise only its end counts.
        flaw: Known instability of the scheme, for error messages; None if it is stable.
    """

    support: float
    smoothing_passes: float = 1.0
    flip_worth: float = 0.0
    descends: bool = False
    keeps_time: bool = True
    flaw: str | None = None


class StepSolver(Protocol):
    """Solver of the motion in a step."""

    @property
    def traits(self) -> SolverTraits:
        """Properties of the solver."""

    def prepare(self, body: Body, physics: Physics, neighbours: NeighbourList) -> PreparedStep:
        """Assemble the parts that do not depend on the time step.

        Args:
            body: Liquid body.
            physics: Effects that act on the body.
            neighbours: Neighbour list with the radius of the solver's ``traits``.
        """

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps."""

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
