"""A step in which velocity and pressure of all particles are solved for at once, by moving least squares."""

from dataclasses import dataclass

import numpy as np

from particles.approximate_projection import project
from particles.body import Body
from particles.discretisation_mls import particle_discretisation
from particles.force_surface_tension import SurfaceTension
from particles.incompressibility import SaddlePoint, Solution, solve
from particles.mass import Mass
from particles.mls import SUPPORT
from particles.neighbours import NeighbourList
from particles.physics import Physics
from particles.pressure_laplacian import pressure_laplacian
from particles.step_equations import StepEquations
from particles.step_solver import Motion

# Pressures up to which the exact divergence is solved for; its factorisation costs 0.2 s at 800 of them, 3 s at 3600.
LARGEST_EXACT = 4000


def _relaxing_density(physics: Physics) -> float | None:
    """Density, if no momentum is kept and every operator but the mass acts on the surface only; else None."""
    on_surface = all(isinstance(part, Mass | SurfaceTension) for part in physics.operators)
    densities = [part.density for part in physics.operators if isinstance(part, Mass)]
    return densities[0] if on_surface and not physics.momenta else None


@dataclass(frozen=True, slots=True)
class CoupledStep:
    """Saddle-point solve of velocity and pressure.

    Attributes:
        basis: basis of the moving least squares, "linear" or "quadratic".
    """

    basis: str

    @property
    def support(self) -> float:
        """Radius of the neighbour list, in spacings."""
        return SUPPORT[self.basis]

    def prepare(self, body: Body, physics: Physics, neighbours: NeighbourList) -> "PreparedCoupledStep":
        """Fit the stencils at the current positions.

        Raises:
            DegenerateStencil: the divergence of a particle cannot be fitted.
        """
        equations = StepEquations(body, physics, particle_discretisation(body, neighbours, self.basis))
        return PreparedCoupledStep(body, neighbours, equations, _relaxing_density(physics))


@dataclass(frozen=True, slots=True)
class PreparedCoupledStep:
    """The equations of a step.

    Attributes:
        body: the liquid body.
        neighbours: a valid list.
        equations: at the body's positions.
        density: where only the surface is coupled and no momentum is kept [kg/m^3], else None.
    """

    body: Body
    neighbours: NeighbourList
    equations: StepEquations
    density: float | None

    def solve(self, time_step: float, volume: float) -> Motion:
        """Return the motion in a time step [s] that ends at a volume [m^3].

        Raises:
            SolveFailed: the linear solve failed.
        """
        solution = self._solve(self.equations.problem(time_step, volume), time_step)
        velocity, twists = self.equations.expand(solution.velocity, time_step)
        surface_pressure = float(solution.pressure[-1])
        pressure = np.full(len(velocity), surface_pressure)
        pressure[self.body.cloud.surface_count :] += solution.pressure[:-1]
        return Motion(velocity, velocity, pressure, surface_pressure, twists, solution.iterations)

    def _solve(self, problem: SaddlePoint, time_step: float) -> Solution:
        """Solve exactly where that is cheap or particles carry or share momentum, else by the compact Laplacian."""
        if self.density is None or len(problem.rate) <= LARGEST_EXACT:
            return solve(problem)
        return project(problem, time_step / self.density * pressure_laplacian(self.body, self.neighbours))
