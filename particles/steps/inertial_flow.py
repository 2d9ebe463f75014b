"""A free body that moves with inertia, its particles and tetrahedra with it: nothing is shifted or smoothed."""

from collections.abc import Mapping
from typing import Any

from scipy import sparse

from reflowshock.particles.core.body import Body
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.inertial_step import InertialStep


class InertialFlow:
    """A body without walls and its steps."""

    def __init__(self, body: Body, physics: Physics, density: float) -> None:
        """Remember the volume to keep.

        Args:
            body: the liquid body; changed in place.
            physics: what acts on it.
            density: of the liquid [kg/m^3].
        """
        self.body, self.physics, self.solver = body, physics, InertialStep(density)
        self.volume = body.volume()[0]

    def saved(self) -> dict[str, Any]:
        """All that a flow of the same physics needs to continue to the same bits, for a checkpoint."""
        return {"body": self.body, "volume": self.volume, "solver": self.solver.saved()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.body, self.volume = saved["body"], saved["volume"]
        self.solver.restore(saved["solver"])

    @property
    def mass(self) -> sparse.csr_matrix:
        """Volumes that the particles carry, `(n, n)` [m^3], from the first step on."""
        return self.solver.mass

    def settle(self, time_step: float, steps: int) -> None:
        """Bring the body to rest: stop all motion after every step [s]."""
        for _ in range(steps):
            self.step(time_step)
            self.solver.stop(self.body)

    def step(self, time_step: float) -> int:
        """Advance one time step [s]; return the iterations of the pressure solve.

        Raises:
            SolveFailed: the linear solve failed.
        """
        body = self.body
        motion = self.solver.start(body, self.physics).solve(time_step, self.volume)
        body.velocity, body.pressure = motion.velocity, motion.pressure
        body.surface_pressure = motion.surface_pressure
        body.move(time_step, motion.transport, motion.twists)
        return motion.iterations
