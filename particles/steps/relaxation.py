"""Relaxation step: the free surface relaxes at constant volume, the particles below it follow as potential flow.

Without inertia and viscosity a step is not a physical motion; only the energy of the surface counts:

    A v = f + p a,     a . v = dV/dt

A is the mass over the time step plus the implicit surface tension, both of the surface particles, a the gradient of the
volume, and the pressure p of the body a single unknown. At rest f = -p a makes the discrete energy stationary. The flux
of the surface motion drives a potential flow inside, which keeps the particles evenly spread; its pressure vanishes at
rest.

No step raises the energy of the triangles, and the volume is exact (``descent.py``). At rest the forces balance except
for displacements that mesh smoothing undoes: where a contact line leaves the edge of a pad at a sharp corner, ever more
distorted triangles would lower the energy. The load of gravity is the gradient of its energy to second order. Mesh
smoothing would shift a free body, so its centre is restored. A motion that does not change from step to step continues
for many steps at once. The number of iterations does not grow with the number of particles.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.plate import slide
from reflowshock.particles.core.surface_measure import centre_of_volume, ring_area, surface_flux
from reflowshock.particles.core.symmetry import fold
from reflowshock.particles.discretisation.discretisation import Discretisation
from reflowshock.particles.discretisation.lagged_multigrid import LaggedMultigrid
from reflowshock.particles.discretisation.volume_constraint import solve_volume
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.potential_flow import PotentialFlow
from reflowshock.particles.steps.step_equations import StepEquations
from reflowshock.particles.steps.step_solver import Motion, SolverTraits

SUPPORT = 2.0
# Motion along the normals distorts the triangles, which biases the shape of least energy: with one pass the height of a
# cap is off by 0.05 % at any spacing.
SMOOTHING_PASSES = 12


@dataclass(slots=True)
class Relaxation:
    """Step solver that relaxes the surface energy.

    Attributes:
        density: Density [kg/m^3].
        centre: Centre of volume at the first step of a body without walls and planes of symmetry, shape (3,) [m]; else
            None.
    """

    density: float
    centre: Floats | None = None
    _multigrid: LaggedMultigrid = field(default_factory=LaggedMultigrid)

    @property
    def traits(self) -> SolverTraits:
        """Properties of the scheme: it descends, and a step is not a physical motion."""
        return SolverTraits(SUPPORT, SMOOTHING_PASSES, descends=True, keeps_time=False)

    def prepare(self, body: Body, physics: Physics, neighbours: NeighbourList) -> "PreparedRelaxation":
        """Assemble the equations of the surface and the operators of the potential flow."""
        if self.centre is None and not body.plates and not body.cloud.symmetry:
            self.centre = centre_of_volume(body.points, body.triangles)
        surface = body.surface()
        equations = StepEquations(surface, physics, _volume_only(surface))
        neighbours.update(body.points)
        return PreparedRelaxation(self, body, equations, PotentialFlow.of(body, neighbours))

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps."""
        return {"centre": self.centre, "multigrid": self._multigrid.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.centre = saved["centre"]
        self._multigrid.restore(saved["multigrid"])

    def potential(self, flow: PotentialFlow, flux: Floats) -> tuple[Floats, int]:
        """Solve for the potential of fluxes into the particles.

        Args:
            flow: Operators of the potential flow.
            flux: Fluxes, shape (n,) [m^3/s].

        Returns:
            Potential, shape (n,) [m^2/s], and the number of iterations.
        """
        return self._multigrid.solve(flow.laplacian, flow.balanced(flux))


def _volume_only(surface: Body) -> Discretisation:
    """Return operators of the free surface alone, with the enclosed volume as the only constraint."""
    nothing = sparse.csr_matrix((0, len(surface.points)))
    return Discretisation(
        gradient=(nothing, nothing, nothing),
        weights=np.zeros(0),
        mass=sparse.diags(surface.volumes, format="csr"),
        constraint=sparse.csr_matrix(surface.volume()[1].T.ravel()),
        volume_share=np.ones(1),
    )


@dataclass(frozen=True, slots=True)
class PreparedRelaxation:
    """Step from the current positions.

    Attributes:
        solver: Step solver.
        body: Liquid body.
        equations: Equations of its free surface.
        flow: Potential flow inside.
    """

    solver: Relaxation
    body: Body
    equations: StepEquations
    flow: PotentialFlow

    def solve(self, time_step: float, volume: float) -> Motion:
        """Compute the motion in a time step.

        Args:
            time_step: Time step [s].
            volume: Enclosed volume at the end of the step [m^3].

        Raises:
            SolveFailed: A linear solve failed.
        """
        body, density, count = self.body, self.solver.density, self.body.cloud.surface_count
        solution = solve_volume(self.equations.problem(time_step, volume))
        surface, twists = self.equations.expand(solution.velocity, time_step)
        surface = surface + self._recentring(surface, time_step)
        potential, iterations = self.solver.potential(self.flow, _flux(body, surface, twists))
        velocity = np.concatenate((surface, _limited(self._inside(potential, twists), surface)))
        surface_pressure = float(solution.pressure[0])
        pressure = surface_pressure - density / time_step * (potential - potential[:count].mean())
        return Motion(velocity, velocity, pressure, surface_pressure, twists, iterations)

    def _recentring(self, surface: Floats, time_step: float) -> Floats:
        """Return the velocity that restores the centre of a free body, which no force moves, shape (3,) [m/s].

        V dc/dt is the integral of x v . n over the surface.
        """
        body = self.body
        if self.solver.centre is None:
            return np.zeros(3)
        points, triangles = body.points[: body.cloud.surface_count], body.triangles
        centre = centre_of_volume(points, triangles)
        drift = surface_flux(points, triangles, surface) @ (points - centre) / body.volume()[0]
        return (self.solver.centre - centre) / time_step - drift

    def _inside(self, potential: Floats, twists: dict[int, Floats]) -> Floats:
        """Return interior velocities, shape (m, 3) [m/s]; on a plate they slip along it and follow its motion."""
        body, rows = self.body, self.body.interior
        wall = body.cloud.wall[rows]
        velocity = fold(body.cloud, slide(body.plates, wall, self.flow.velocity(potential)), body.cloud.surface_count)
        for number, twist in twists.items():
            on_plate = wall == number
            carried = body.plates[number].rigid_velocity(twist, body.points[rows[on_plate]])
            velocity[on_plate] += carried - slide(body.plates, wall[on_plate], carried)
        return velocity


def _limited(inside: Floats, surface: Floats) -> Floats:
    """Limit velocities of shape (m, 3) to the largest speed of the surface, as the maximum principle requires.

    In a film thinner than the particle distance the few neighbours of a particle do not ensure this.
    """
    speed = np.linalg.norm(inside, axis=1)
    largest = np.linalg.norm(surface, axis=1).max()
    return inside * np.minimum(1.0, largest / np.maximum(speed, np.finfo(float).tiny))[:, None]


def _flux(body: Body, surface: Floats, twists: dict[int, Floats]) -> Floats:
    """Return the flux through the boundary by particle, shape (n,) [m^3/s].

    The flux through the surface belongs to its vertices; that through a plate is distributed over the particles on it.
    """
    flux = np.zeros(len(body.points))
    flux[: body.cloud.surface_count] = surface_flux(body.points, body.triangles, surface)
    for wall, twist in twists.items():
        plate, ring, on_plate = body.plates[wall], body.cloud.rings[wall], body.cloud.wall == wall
        centre = body.points[ring].mean(axis=0)[None]
        outward = plate.side * float((plate.rigid_velocity(twist, centre) @ plate.normal)[0])
        share = body.volumes * on_plate
        flux += outward * ring_area(body.points, ring) * share / share.sum()
    return flux
