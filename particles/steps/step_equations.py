"""The linear equations of one step: forces, implicit operators, constraints, in the velocities that walls admit."""

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.discretisation.discretisation import Discretisation
from reflowshock.particles.discretisation.incompressibility import SaddlePoint
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.admissible import Admissible


class StepEquations:
    """Equations of a body at its current positions, for any time step.

    Degrees of freedom are stored by component: all x, all y, all z.
    """

    def __init__(self, body: Body, physics: Physics, space: Discretisation) -> None:
        """Build what does not depend on the time step.

        Args:
            body: the liquid body.
            physics: what acts on it.
            space: operators at the body's current positions.
        """
        self._body, self._physics, self._space = body, physics, space
        self._admissible = Admissible(body, physics.pinned(body), physics.motions)
        self._volume = body.volume()[0]
        self._reduced_constraint = (space.constraint @ self._admissible.basis).tocsr()
        self._force = physics.force(body)

    def problem(self, time_step: float, volume: float) -> SaddlePoint:
        """Build the saddle-point problem for a time step [s] that ends at a volume [m^3]."""
        body, physics, space = self._body, self._physics, self._space
        operator = sum(part.matrix(body, space, time_step) for part in physics.operators)
        load = self._force + sum(momentum.load(body, space, time_step) for momentum in physics.momenta)
        given, basis = self._admissible.given(time_step), self._admissible.basis
        rate = (volume - self._volume) / time_step * space.volume_share - space.constraint @ given
        reduced, drag = self._friction(time_step)
        return SaddlePoint(
            operator=(basis.T @ operator @ basis + reduced).tocsr(),
            constraint=self._reduced_constraint,
            load=self._admissible.reduce(load.T.ravel() - operator @ given) + drag,
            rate=rate,
            stabilisation=self._stabilisation(time_step),
        )

    def _stabilisation(self, time_step: float) -> sparse.csr_matrix | None:
        """S = tau times the space's, 1/tau = 1/dt + the rate of diffusion (Codina 2000)."""
        space = self._space
        if space.stabilisation is None:
            return None
        return time_step / (1.0 + time_step * space.diffusion_rate) * space.stabilisation

    def _friction(self, time_step: float) -> tuple[sparse.csr_matrix | float, Floats | float]:
        """Frictions on the degrees of freedom: matrix `(d, d)` [kg/s], and the drag of plates that move `(d,)` [N]."""
        parts = [part.matrix(self._body, self._space, time_step) for part in self._physics.frictions]
        if not parts:
            return 0.0, 0.0
        slip = self._admissible.slip_basis
        return slip.T @ sum(parts) @ slip, -(slip.T @ (sum(parts) @ self._admissible.slip_given(time_step)))

    def expand(self, unknowns: Floats, time_step: float) -> tuple[Floats, dict[int, Floats]]:
        """Velocities `(n, 3)` of the degrees of freedom `(d,)`, and the twists of the plates that move."""
        full = self._admissible.basis @ unknowns + self._admissible.given(time_step)
        return np.ascontiguousarray(full.reshape(3, -1).T), self._admissible.twists(unknowns, time_step)
