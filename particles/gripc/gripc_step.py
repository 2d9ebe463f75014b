"""The paper's ISPG scheme (Hu et al., 2.2-2.6): prediction, rotational pressure correction, velocity smoothing.

As printed: strong form at the particles, moving least squares, explicit pressure of the surface tension on the free
surface, so that the time step is bound by the capillary limit. Different: walls are mirrored (their Neumann rows make
Krylov solvers fail), the normal viscous stress is part of the pressure on the free surface (without it nothing damps an
oscillation), and the pressure at a contact line is that of the surface energy, whose natural condition is the contact
angle (their overwritten normal is worse). Kept for comparison: it loses volume in each step, which the flow gives back.
With a quadratic basis a drop at rest stays there, and a cube becomes a drop some percent off that goes on swinging, or
loses particles at its contact line; with the linear basis, as printed, even a drop at rest breaks up.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.data_file import fields_of
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.gripc.collocation import Operators, collocate
from reflowshock.particles.gripc.moving_least_squares import SUPPORT
from reflowshock.particles.gripc.projection import (
    Correction,
    Poisson,
    Velocities,
    correct_pressure,
    predict_velocity,
    smooth,
)
from reflowshock.particles.physics.operators import Mass, Viscosity
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.step_solver import Motion, SolverTraits
from reflowshock.particles.surface.surface_quality import vertex_normals

FLAW = (
    "the printed pressure correction is unstable: with direct nodal integration eq 12 is a strong form, whose pressure "
    "gradient and divergence are not each other's transpose, so that oscillations from particle to particle grow at "
    'any time step; solder.numerics.scheme = "ispg" is the method in a form that holds'
)


class GripcStep:
    """Rotational incremental pressure correction; keeps the unsmoothed velocities of the last step."""

    def __init__(self, basis: str) -> None:
        """Start from rest; `basis` is "linear" (as printed) or "quadratic"."""
        self.basis = basis
        self.velocities: Velocities | None = None

    @property
    def traits(self) -> SolverTraits:
        """It does not descend: its pressure is explicit, and it loses volume."""
        return SolverTraits(support=SUPPORT[self.basis], flaw=FLAW)

    def prepare(self, body: Body, physics: Physics, _neighbours: NeighbourList) -> "PreparedGripcStep":
        """Fit the operators at the current positions.

        Raises:
            ValueError: a plate moves.
            DegenerateStencil: the derivatives at a particle cannot be fitted.
        """
        if physics.motions:
            raise ValueError('solder.numerics.scheme = "gripc" knows plates at rest only; "energy" lets them move')
        operators = collocate(body.points, body.plates, body.cloud.spacing, self.basis)
        rest = np.zeros(3 * len(body.points))
        last = self.velocities if physics.momenta and self.velocities is not None else Velocities(rest, rest)
        return PreparedGripcStep(self, body, physics, operators, last)

    def saved(self) -> dict[str, Any]:
        """What it remembers of the last step, for a checkpoint."""
        return {"velocities": self.velocities and fields_of(self.velocities)}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.velocities = saved["velocities"] and Velocities(**saved["velocities"])


@dataclass(frozen=True, slots=True)
class PreparedGripcStep:
    """The equations of a step.

    Attributes:
        solver: takes over the velocities of the last solve.
        body: the liquid body.
        physics: what acts on it.
        operators: at the body's positions.
        last: velocities before the step; zero in the quasi-static mode.
    """

    solver: GripcStep
    body: Body
    physics: Physics
    operators: Operators
    last: Velocities

    def solve(self, time_step: float, _volume: float) -> Motion:
        """Return the motion in a time step [s]; nothing here keeps the volume of the whole body.

        Raises:
            SolveFailed: a linear solve failed.
        """
        body, operators = self.body, self.operators
        fluid = (self._density() / time_step, self._viscosity())
        slope, basis = self._slope(body.pressure), self.solver.basis
        predicted = self._admit(predict_velocity(operators, fluid, self.last.unsmoothed, slope, basis))
        surface = np.arange(len(body.points)) < body.cloud.surface_count
        given = self._given_pressure(predicted)
        poisson = Poisson(operators, surface, basis)
        correction = correct_pressure(poisson, fluid, operators.divergence @ predicted, body.pressure, given)
        coefficients = self._admit(predicted - self._impulse(correction) / fluid[0])
        self.solver.velocities = smooth(self.last, coefficients, operators.smoothing)
        velocity = _by_particle(self._admit(operators.smoothing @ coefficients))
        return Motion(velocity, velocity, correction.pressure, float(given[surface].mean()), {}, correction.iterations)

    def _given_pressure(self, predicted: Floats) -> Floats:
        """Pressure on the free surface, zero below it, `(n,)` [Pa]."""
        slope = np.stack([(part @ predicted).reshape(3, -1) for part in self.operators.velocity_gradient], axis=1)
        given = np.zeros(len(self.body.points))
        given[: self.body.cloud.surface_count] = force_pressure(self.body, self.physics) + viscous_pressure(
            self.body, self._viscosity(), slope
        )
        return given

    def _density(self) -> float:
        return sum(part.density for part in self.physics.operators if isinstance(part, Mass))

    def _viscosity(self) -> float:
        return sum(part.coefficient for part in self.physics.operators if isinstance(part, Viscosity))

    def _admit(self, velocity: Floats) -> Floats:
        """The part of a velocity `(3 n,)` that walls and edges allow."""
        return self.physics.admit(self.body, _by_particle(velocity)).T.ravel()

    def _slope(self, scalar: Floats) -> Floats:
        """Gradient `(3 n,)` of a scalar's coefficients `(n,)`."""
        return np.concatenate([component @ scalar for component in self.operators.gradient])

    def _impulse(self, correction: Correction) -> Floats:
        """Gradient of phi, averaged by the lumped mass matrix, eq 26: N^T m grad phi over N^T m 1."""
        operators, volumes = self.operators, self.body.volumes
        averaged = operators.velocity_values.T @ (np.tile(volumes, 3) * self._slope(correction.potential))
        return averaged / np.tile(operators.values.T @ volumes, 3)


def _by_particle(velocity: Floats) -> Floats:
    return np.ascontiguousarray(velocity.reshape(3, -1).T)


def force_pressure(body: Body, physics: Physics) -> Floats:
    """Pressure that balances the forces on each vertex of the free surface, `(s,)` [Pa] above ambient.

    On a contact line it is that of the surface next to it, less what the force within the wall is out of balance with
    (wall adhesion is one of the forces, so that this balance is the contact angle), over the area of the vertex. An
    edge bears what is left on a vertex that it holds.
    """
    count = body.cloud.surface_count
    force, slope = physics.force(body), body.volume()[1]
    pressure = -(force * slope)[:count].sum(axis=1) / (slope[:count] ** 2).sum(axis=1)
    normal = np.zeros_like(force)
    normal[:count] = vertex_normals(body.points, body.triangles, count)
    within = physics.admit(body, normal)
    for ring in body.cloud.rings:
        pressure[ring] = _mean_of_neighbours(body, pressure)[ring]
        loose = ring[within[ring].any(axis=1)]
        beside = np.zeros((len(force), 1))
        beside[loose, 0] = pressure[loose]
        unbalanced = (physics.admit(body, force + beside * slope) * within)[loose].sum(axis=1)
        # The area of a vertex along its normal is its area within the wall over the normal's part within the wall.
        area = (slope * within)[loose].sum(axis=1) / np.linalg.norm(within[loose], axis=1)
        pressure[loose] -= unbalanced / area
    return pressure


def _mean_of_neighbours(body: Body, values: Floats) -> Floats:
    """Mean over the vertices off the walls of the triangles around each vertex, `(s,)`."""
    off_walls = body.cloud.wall[: len(values)] < 0
    total, count = np.zeros(len(values)), np.zeros(len(values))
    for corner in range(3):
        for other in (1, 2):
            at, near = body.triangles[:, corner], body.triangles[:, (corner + other) % 3]
            np.add.at(total, at, np.where(off_walls[near], values[near], 0.0))
            np.add.at(count, at, off_walls[near])
    return total / np.maximum(count, 1.0)


def viscous_pressure(body: Body, viscosity: float, gradient: Floats) -> Floats:
    """Normal viscous stress 2 mu n . grad v . n on the free surface, `(s,)` [Pa]: the surrounding gas exerts none.

    The paper's eq 9 leaves it out. The viscous force in the bulk of an irrotational flow vanishes, so that oscillations
    of a drop would not be damped but by errors.

    Args:
        body: the liquid body.
        viscosity: dynamic viscosity [Pa s].
        gradient: `(3, 3, n)` dv_i / dx_j [1/s].
    """
    normal = vertex_normals(body.points, body.triangles, body.cloud.surface_count)
    surface = gradient[:, :, : len(normal)]
    return 2.0 * viscosity * np.einsum("ki,ijk,kj->k", normal, surface, normal)
