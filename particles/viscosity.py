"""Implicit viscosity: the weak form of 2 mu D : D with direct nodal integration."""

from dataclasses import dataclass

from scipy import sparse

from particles.body import Body
from particles.mls import Derivatives


@dataclass(frozen=True, slots=True)
class Viscosity:
    """Newtonian viscosity of the particles below the surface.

    Attributes:
        coefficient: dynamic viscosity mu [Pa s].
    """

    coefficient: float

    def matrix(self, body: Body, stencils: Derivatives, _time_step: float) -> sparse.csr_matrix:
        """Matrix of the virtual power, `(3 n, 3 n)` [kg/s], components one after the other.

        With D = (grad v + grad v^T) / 2 and particle volumes as weights:
        2 mu D : D = mu (grad v : grad v + grad v : grad v^T). Symmetric, positive semidefinite, zero for rigid motion.
        """
        gradient = stencils.gradient
        weight = sparse.diags(self.coefficient * body.volumes[stencils.rows])
        full = sum(component.T @ weight @ component for component in gradient)
        blocks = [[gradient[j].T @ weight @ gradient[i] for j in range(3)] for i in range(3)]
        for i in range(3):
            blocks[i][i] = blocks[i][i] + full
        return sparse.bmat(blocks, format="csr")
