"""ISPG step as printed (Hu et al., 2.2 to 2.6): prediction, rotational pressure correction, velocity smoothing.

Strong form at the particles by moving least squares, with an explicit pressure of the surface tension on the free
surface, so that the time step is bound by the capillary limit. Differences from the paper: walls are mirrored (its
Neumann rows make Krylov solvers fail); the normal viscous stress is part of the pressure on the free surface (without
it nothing damps an oscillation); and the pressure at a contact line derives from the surface energy, whose natural
condition is the contact angle (overwriting the normal is less accurate).

The scheme is kept for comparison. It loses volume in each step, which the flow restores. With the quadratic basis a
drop at rest stays at rest, but a cube becomes a drop some percent off that keeps oscillating or loses particles at its
contact line. With the linear basis, as printed, even a drop at rest breaks up.
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
    Material,
    Poisson,
    Velocities,
    correct_pressure,
    predict_velocity,
    smooth_velocities,
)
from reflowshock.particles.physics.operators import Mass, Viscosity
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.step_solver import Motion, SolverTraits
from reflowshock.particles.surface.surface_quality import vertex_normals

FLAW = (
    "the printed pressure correction is unstable: with direct nodal integration eq 12 is a strong form, whose pressure "
    "gradient and divergence are not each other's transpose, so that oscillations from particle to particle grow at "
    'any time step; solder.numerics.scheme = "ispg" is the method in a stable form'
)


class GripcStep:
    """Step solver with rotational incremental pressure correction; it keeps the velocities of the last step."""

    def __init__(self, basis: str) -> None:
        """Start from rest; ``basis`` is "linear" (as printed) or "quadratic"."""
        self.basis = basis
        self.velocities: Velocities | None = None

    @property
    def traits(self) -> SolverTraits:
        """Properties of the scheme; it does not descend, because its pressure is explicit and it loses volume."""
        return SolverTraits(support=SUPPORT[self.basis], flaw=FLAW)

    def prepare(self, body: Body, physics: Physics, _neighbours: NeighbourList) -> "PreparedGripcStep":
        """Fit the operators at the current positions.

        Raises:
            ValueError: A plate moves.
            DegenerateStencil: The derivatives at a particle cannot be fitted.
        """
        if physics.motions:
            raise ValueError('solder.numerics.scheme = "gripc" supports plates at rest only; use "energy" or "ispg"')
        operators = collocate(body.points, body.plates, body.cloud.spacing, self.basis)
        rest = np.zeros(3 * len(body.points))
        last = self.velocities if physics.momenta and self.velocities is not None else Velocities(rest, rest)
        return PreparedGripcStep(self, body, physics, operators, last)

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps."""
        return {"velocities": self.velocities and fields_of(self.velocities)}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.velocities = saved["velocities"] and Velocities(**saved["velocities"])


@dataclass(frozen=True, slots=True)
class PreparedGripcStep:
    """Equations of a step.

    Attributes:
        solver: Step solver, which keeps the velocities after the step.
        body: Liquid body.
        physics: Effects that act on the body.
        operators: Operators at the current positions.
        last: Velocities before the step; zero in the quasi-static mode.
    """

    solver: GripcStep
    body: Body
    physics: Physics
    operators: Operators
    last: Velocities

    def solve(self, time_step: float, _volume: float) -> Motion:
        """Compute the motion in a time step [s]; the enclosed volume is not controlled.

        Raises:
            SolveFailed: A linear solve failed.
        """
        body, operators = self.body, self.operators
        material = Material(self._density() / time_step, self._viscosity())
        slope, basis = self._slope(body.pressure), self.solver.basis
        predicted = self._admit(predict_velocity(operators, material, self.last.unsmoothed, slope, basis))
        surface = np.arange(len(body.points)) < body.cloud.surface_count
        boundary = self._surface_pressure(predicted)
        poisson = Poisson(operators, surface, basis)
        correction = correct_pressure(poisson, material, operators.divergence @ predicted, body.pressure, boundary)
        coefficients = self._admit(predicted - self._impulse(correction) / material.inertia)
        self.solver.velocities = smooth_velocities(self.last, coefficients, operators.smoothing)
        velocity = _by_particle(self._admit(operators.smoothing @ coefficients))
        return Motion(
            velocity, velocity, correction.pressure, float(boundary[surface].mean()), {}, correction.iterations
        )

    def _surface_pressure(self, predicted: Floats) -> Floats:
        """Return the pressure on the free surface, zero below it, shape (n,) [Pa]."""
        slope = np.stack([(part @ predicted).reshape(3, -1) for part in self.operators.velocity_gradient], axis=1)
        boundary = np.zeros(len(self.body.points))
        boundary[: self.body.cloud.surface_count] = force_pressure(self.body, self.physics) + viscous_pressure(
            self.body, self._viscosity(), slope
        )
        return boundary

    def _density(self) -> float:
        return sum(part.density for part in self.physics.operators if isinstance(part, Mass))

    def _viscosity(self) -> float:
        return sum(part.coefficient for part in self.physics.operators if isinstance(part, Viscosity))

    def _admit(self, velocity: Floats) -> Floats:
        """Return the part of a velocity of shape (3 n,) that walls and edges admit."""
        return self.physics.admit(self.body, _by_particle(velocity)).T.ravel()

    def _slope(self, scalar: Floats) -> Floats:
        """Return the gradient of a scalar with coefficients of shape (n,), shape (3 n,)."""
        return np.concatenate([component @ scalar for component in self.operators.gradient])

    def _impulse(self, correction: Correction) -> Floats:
        """Return the gradient of phi averaged by the lumped mass matrix, N^T m grad phi over N^T m 1 (eq 26)."""
        operators, volumes = self.operators, self.body.volumes
        averaged = operators.velocity_values.T @ (np.tile(volumes, 3) * self._slope(correction.potential))
        return averaged / np.tile(operators.values.T @ volumes, 3)


def _by_particle(velocity: Floats) -> Floats:
    return np.ascontiguousarray(velocity.reshape(3, -1).T)


def force_pressure(body: Body, physics: Physics) -> Floats:
    """Return the pressure that balances the forces on each vertex of the free surface, shape (s,) [Pa].

    On a contact line it is the pressure of the neighbouring surface, less the unbalanced force within the wall over the
    area of the vertex; wall adhesion is one of the forces, so that this balance gives the contact angle. A pad edge
    carries the remaining force on a vertex that it pins.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        physics: Effects that act on the body: forces, friction, contact lines and motions of plates.
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
        neighbouring = np.zeros((len(force), 1))
        neighbouring[loose, 0] = pressure[loose]
        unbalanced = (physics.admit(body, force + neighbouring * slope) * within)[loose].sum(axis=1)
        # Area of a vertex along its normal: its area within the wall over the component of the normal within the wall.
        area = (slope * within)[loose].sum(axis=1) / np.linalg.norm(within[loose], axis=1)
        pressure[loose] -= unbalanced / area
    return pressure


def _mean_of_neighbours(body: Body, values: Floats) -> Floats:
    """Return the mean over the neighbouring vertices off the walls, shape (s,)."""
    off_walls = body.cloud.wall[: len(values)] < 0
    total, count = np.zeros(len(values)), np.zeros(len(values))
    for corner in range(3):
        for other in (1, 2):
            at, near = body.triangles[:, corner], body.triangles[:, (corner + other) % 3]
            np.add.at(total, at, np.where(off_walls[near], values[near], 0.0))
            np.add.at(count, at, off_walls[near])
    return total / np.maximum(count, 1.0)


def viscous_pressure(body: Body, viscosity: float, gradient: Floats) -> Floats:
    """Return the normal viscous stress 2 mu n . grad v . n on the free surface, shape (s,) [Pa].

    The surrounding gas exerts none. Eq 9 of the paper leaves this stress out: the viscous force in an irrotational flow
    vanishes, so that only numerical errors would damp the oscillation of a drop.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        viscosity: Dynamic viscosity [Pa s].
        gradient: Velocity gradient dv_i / dx_j, shape (3, 3, n) [1/s].
    """
    normal = vertex_normals(body.points, body.triangles, body.cloud.surface_count)
    surface = gradient[:, :, : len(normal)]
    return 2.0 * viscosity * np.einsum("ki,ijk,kj->k", normal, surface, normal)
