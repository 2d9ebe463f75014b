"""Implicit viscosity: the weak form of 2 mu D : D, summed over the points of integration."""

from dataclasses import dataclass

from scipy import sparse

from reflowshock.particles.core.body import Body
from reflowshock.particles.discretisation.discretisation import Discretisation


@dataclass(frozen=True, slots=True)
class Viscosity:
    """Newtonian viscosity.

    Attributes:
        coefficient: dynamic viscosity mu [Pa s].
    """

    coefficient: float

    def matrix(self, _body: Body, space: Discretisation, _time_step: float) -> sparse.csr_matrix:
        """Matrix of the virtual power, `(3 n, 3 n)` [kg/s], components one after the other.

        With D = (grad v + grad v^T) / 2:
        2 mu D : D = mu (grad v : grad v + grad v : grad v^T). Symmetric, positive semidefinite, zero for rigid motion.
        """
        gradient = space.gradient
        weight = sparse.diags(self.coefficient * space.weights)
        full = sum(component.T @ weight @ component for component in gradient)
        blocks = [[gradient[j].T @ weight @ gradient[i] for j in range(3)] for i in range(3)]
        for i in range(3):
            blocks[i][i] = blocks[i][i] + full
        return sparse.bmat(blocks, format="csr")
