"""Motion of a liquid body with inertia, of second order in time: BDF2, one linear solve a step.

Forces and operators are taken at the predicted positions x* = x_base + dt_eff v_n. The implicit surface tension then
acts on v - v_n only: an added mass of order dt^2, not a damping of order dt.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from particles.backward_difference import BackwardDifference
from particles.body import Body
from particles.discretisation import Discretisation
from particles.discretisation_tetrahedra import LinearTetrahedra
from particles.force_surface_tension import SurfaceTension
from particles.incompressibility import solve
from particles.physics import Physics
from particles.step_equations import StepEquations

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PredictedTension:
    """Surface tension has moved the body to the predicted positions already: only the rest is implicit.

    Attributes:
        tension: the surface tension.
        velocity: of the prediction, `(n, 3)` [m/s].
    """

    tension: SurfaceTension
    velocity: Floats

    def load(self, body: Body, space: Discretisation, time_step: float) -> Floats:
        """Return dt gamma K v, `(n, 3)` [N]."""
        matrix = self.tension.matrix(body, space, time_step)
        return np.ascontiguousarray((matrix @ self.velocity.T.ravel()).reshape(3, -1).T)


class InertialFlow:
    """A body that moves without walls, its particles and tetrahedra with it."""

    def __init__(self, body: Body, physics: Physics, space: LinearTetrahedra) -> None:
        """Remember the volume to keep.

        Args:
            body: the liquid body; changed in place.
            physics: what acts on it.
            space: the tetrahedra between its particles.
        """
        self.body, self.physics, self.space = body, physics, space
        self.volume = body.volume()[0]
        self._history = BackwardDifference.start(len(body.points))

    def settle(self, time_step: float, steps: int) -> None:
        """Bring the body to rest: stop all motion after every step [s]."""
        for _ in range(steps):
            self.step(time_step)
            self.body.velocity = np.zeros_like(self.body.velocity)
            self._history = BackwardDifference.start(len(self.body.points))

    def _predicted(self, velocity: Floats) -> Physics:
        """Physics at the positions that a velocity `(n, 3)` predicts."""
        tensions = (part for part in self.physics.operators if isinstance(part, SurfaceTension))
        loads = [PredictedTension(tension, velocity) for tension in tensions]
        return replace(self.physics, momenta=(*self.physics.momenta, *loads))

    def step(self, time_step: float) -> int:
        """Advance one time step [s]; return the iterations of the pressure solve.

        Raises:
            SolveFailed: the linear solve failed.
        """
        body = self.body
        points, velocity = body.points, body.velocity
        base = self._history.base(points, velocity, time_step)
        body.points, body.velocity = base.points + base.time_step * velocity, base.velocity
        physics = self._predicted(velocity)
        space = self.space(body)
        equations = StepEquations(body, physics, space)
        swept = base.time_step * float((space.constraint @ velocity.T.ravel()).sum())
        solution = solve(equations.problem(base.time_step, self.volume + swept))
        body.velocity = equations.expand(solution.velocity, base.time_step)[0]
        body.points = base.points + base.time_step * body.velocity
        body.pressure = solution.pressure
        body.surface_pressure = float(space.volume_share @ solution.pressure)
        self._history.remember(body.points - points, body.velocity - velocity, time_step)
        return solution.iterations
