"""Surface tension as the energy gradient of the tracked surface, with its semi-implicit stiffness."""

from dataclasses import dataclass

from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.surface_measure import cotangent_laplacian, surface_area
from reflowshock.particles.discretisation.discretisation import Discretisation


@dataclass(frozen=True, slots=True)
class SurfaceTension:
    """Energy E = gamma A of the free surface.

    Attributes:
        coefficient: surface tension gamma [N/m].
    """

    coefficient: float

    def energy(self, body: Body) -> float:
        """Surface energy [J]."""
        return self.coefficient * surface_area(body.points, body.triangles)

    def _stiffness(self, body: Body) -> sparse.csr_matrix:
        return self.coefficient * cotangent_laplacian(body.points, body.triangles, len(body.points))

    def force(self, body: Body) -> Floats:
        """Force -dE/dx = -gamma K x, `(n, 3)` [N]."""
        return -(self._stiffness(body) @ body.points)

    def matrix(self, body: Body, _space: Discretisation, time_step: float) -> sparse.csr_matrix:
        """Semi-implicit part dt gamma K, `(3 n, 3 n)` [kg/s]: the force at the end of the step is f - dt gamma K v."""
        return sparse.kron(sparse.identity(3), time_step * self._stiffness(body), format="csr")
