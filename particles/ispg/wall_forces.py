"""Forces of pinning or frictional walls on the liquid in a step, and their power in the motion of the plates."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg import step_kernels as kernels
from reflowshock.particles.ispg.galerkin_equations import GalerkinEquations
from reflowshock.particles.ispg.galerkin_space import GalerkinSpace
from reflowshock.particles.ispg.rigid_motions import wall_velocities
from reflowshock.particles.steps.descent import ARRIVED


@dataclass(frozen=True, slots=True)
class StepSolution:
    """Solution of the equations of a step.

    Attributes:
        force: Surface force, including the surface tension along the prediction, shape (n, 3) [N].
        start: Velocity at the start of the equivalent backward Euler step, shape (n, 3) [m/s].
        after_friction: Velocity after the friction solve, shape (n, 3) [m/s].
        mean: Mean velocity of the step, shape (n, 3) [m/s].
        pressure: Pressure coefficients, shape (n,) [Pa].
    """

    force: Floats
    start: Floats
    after_friction: Floats
    mean: Floats
    pressure: Floats


@dataclass(frozen=True, slots=True)
class WallForces:
    """Forces of pinning or frictional walls on the liquid.

    Their power in the velocity of a wall (``Ghosts.drift`` at ghost particles) is the power that the wall supplies.

    Attributes:
        space: Shape functions and ghost particles.
        on_particles: Forces on the particles, shape (n, 3) [N].
        on_ghosts: Forces by stress on the ghost particles, shape (g, 3) [N].
    """

    space: GalerkinSpace
    on_particles: Floats
    on_ghosts: Floats

    @classmethod
    def of(cls, equations: GalerkinEquations, solution: StepSolution) -> "WallForces":
        """Compute the forces that the momentum balance of a step requires from the walls."""
        space, count, after_friction = equations.space, len(solution.force), solution.after_friction
        rows, volumes = space.rows, space.volumes
        drag = equations.drag[:, None] * (after_friction - space.unresolved(after_friction) - equations.walls)
        stress = kernels.resistance(*rows, space.with_images(after_friction), equations.factors)
        stress -= space.shape.T @ (equations.drag[:, None] * equations.walls)
        inertia = equations.momentum(solution.mean - solution.start) / equations.time_step
        tension = equations.time_step * equations.tension_stiffness(solution.mean)
        pull = solution.force - tension + equations.pressure_forces(solution.pressure)
        missing = inertia + kernels.folded(stress, *space.images) - pull
        thrust = np.zeros_like(stress)
        kernels.divergence_transposed(*rows, equations.balanced(volumes * solution.pressure), thrust)
        reaction = missing - kernels.projected(equations.admitted, missing) - drag
        return cls(space, reaction, (stress - thrust)[count:])

    def power(self, body: Body, twists: Mapping[int, Floats]) -> float:
        """Return the power that moving plates supply [W].

        Args:
            body: Liquid body with its plates.
            twists: Twist of each moving plate by its index, shape (6,) [m/s, rad/s].
        """
        at_walls, at_ghosts = wall_velocities(body, twists), self.space.drift_of(body, twists)
        return float((self.on_particles * at_walls).sum() + (self.on_ghosts * at_ghosts).sum())

    def work(self, body: Body, displacements: Mapping[int, Floats]) -> tuple[float, float]:
        """Return the work of the forces along displacements of the plates, and the mean force along these.

        Args:
            body: Liquid body with its plates.
            displacements: Displacement and rotation of each moving plate by its index, shape (6,) [m, rad].

        Returns:
            Work [J] and mean force [N]; the force is NaN for plates that do not move.
        """
        work = self.power(body, displacements)
        distance = float(np.linalg.norm([change[:3] for change in displacements.values()]))
        return work, work / distance if distance > ARRIVED * body.cloud.spacing else float("nan")
