"""The linear equations of one step: forces, implicit operators, constraints, in the velocities that walls admit."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from particles.admissible import Admissible
from particles.body import Body
from particles.incompressibility import SaddlePoint
from particles.mls import derivatives
from particles.neighbours import NeighbourList
from particles.physics import Physics

Floats = NDArray[np.float64]


class StepEquations:
    """Equations of a body at its current positions, for any time step.

    Degrees of freedom are stored by component: all x, all y, all z.
    """

    def __init__(self, body: Body, physics: Physics, neighbours: NeighbourList, basis: str) -> None:
        """Fit the stencils and build what does not depend on the time step.

        Args:
            body: the liquid body.
            physics: what acts on it.
            neighbours: a valid list with the support radius of the basis.
            basis: "linear" or "quadratic".

        Raises:
            DegenerateStencil: the divergence of a particle cannot be fitted.
        """
        self._body, self._physics = body, physics
        self._admissible = Admissible(body, physics.pinned(body), physics.motions)
        self._stencils = derivatives(body.points, body.interior, neighbours, basis)
        self._volume, gradient = body.volume()
        share = sparse.diags(body.volumes[body.interior])
        divergence = sparse.hstack([share @ component for component in self._stencils.gradient])
        self._constraint = sparse.vstack((divergence, sparse.csr_matrix(gradient.T.ravel())), format="csr")
        self._reduced_constraint = (self._constraint @ self._admissible.basis).tocsr()
        self._force = physics.force(body)

    def problem(self, time_step: float, volume: float) -> SaddlePoint:
        """Build the saddle-point problem for a time step [s] that ends at a volume [m^3]."""
        body, physics = self._body, self._physics
        operator = sum(part.matrix(body, self._stencils, time_step) for part in physics.operators)
        load = self._force + sum(momentum.load(body, time_step) for momentum in physics.momenta)
        given, basis = self._admissible.given(time_step), self._admissible.basis
        rate = -(self._constraint @ given)
        rate[-1] += (volume - self._volume) / time_step
        reduced_load = self._admissible.reduce(load.T.ravel() - operator @ given)
        return SaddlePoint((basis.T @ operator @ basis).tocsr(), self._reduced_constraint, reduced_load, rate)

    def expand(self, unknowns: Floats, time_step: float) -> tuple[Floats, dict[int, Floats]]:
        """Velocities `(n, 3)` of the degrees of freedom `(d,)`, and the twists of the plates that move."""
        full = self._admissible.basis @ unknowns + self._admissible.given(time_step)
        return np.ascontiguousarray(full.reshape(3, -1).T), self._admissible.twists(unknowns, time_step)
