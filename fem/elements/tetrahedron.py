"""Tetrahedra with 4 and 10 nodes; node order as in DOLFINx."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.kind import Geometry, strain_matrix

EDGES = np.array([[2, 3], [1, 3], [1, 2], [0, 3], [0, 2], [0, 1]])  # vertices of the edges of the middle nodes 4 to 9
# Vertices and face centroids in barycentric coordinates, weights of volume 1/6: exact for cubics (Stroud 1971, T3:3-3),
# so that curved elements pass the patch test; points at the vertices detect inverted elements.
CUBIC_POINTS = np.concatenate([np.eye(4), (1.0 - np.eye(4)) / 3.0])
CUBIC_WEIGHTS = np.repeat([1.0 / 240.0, 9.0 / 240.0], 4)
LINEAR_SHARE = np.full(4, 1.0 / 4.0)
# Diagonal of the consistent mass, scaled to the total (Hinton, Rock & Zienkiewicz 1976); row sums would be negative at
# the vertices.
QUADRATIC_SHARE = np.repeat([1.0 / 36.0, 4.0 / 27.0], [4, 6])
# Derivatives of the barycentric coordinates.
BARYCENTRIC = np.array([[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def quadratic_derivatives(barycentric: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivatives dN_a/dxi_d of the ten quadratic shape functions of a tetrahedron, shape (q, 10, 3).

    Args:
        barycentric: Points in barycentric coordinates, shape (q, 4); xi_d (d = 0 to 2) is coordinate d + 1.
    """
    vertices = (4.0 * barycentric - 1.0)[:, :, None] * BARYCENTRIC
    first, second = EDGES.T
    edges = barycentric[:, first, None] * BARYCENTRIC[second] + barycentric[:, second, None] * BARYCENTRIC[first]
    return np.concatenate([vertices, 4.0 * edges], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class Tetrahedron:
    """Numerically integrated tetrahedron.

    Attributes:
        name: Name in case files.
        derivatives: Derivatives dN_a/dxi_d at the integration points, shape (q, k, 3).
        weights: Weights of the integration points, with sum 1/6, shape (q,).
        share: Share of each node in the volume, shape (k,).
        hourglass: False, because tetrahedra have no hourglass control.
    """

    name: str
    derivatives: NDArray[np.float64]
    weights: NDArray[np.float64]
    share: NDArray[np.float64]
    hourglass: bool = False

    @property
    def nodes(self) -> int:
        """Number of nodes, k."""
        return len(self.share)

    def geometry(self, corners: NDArray[np.float64]) -> Geometry:
        """Return the integrals over elements; nodal volumes are fixed shares of the volume."""
        gradient, determinant = self.gradients(corners)
        volume = determinant @ self.weights
        shares = determinant * self.weights / np.where(volume == 0.0, 1.0, volume)[:, None]
        mean = np.einsum("eq,eqai->eai", shares, gradient)
        return Geometry(volume[:, None] * self.share, mean, determinant.min(axis=1))

    def stiffness(
        self, corners: NDArray[np.float64], elasticity: NDArray[np.float64], material: NDArray[np.int32]
    ) -> NDArray[np.float64]:
        """Return the stiffness ``(ne, 3k, 3k)`` [N/m]: the sum over integration points of B^T C B."""
        gradient, determinant = self.gradients(corners)
        result = np.zeros((len(corners), 3 * self.nodes, 3 * self.nodes))
        for q, weight in enumerate(self.weights):
            strain = strain_matrix(gradient[:, q])
            stress = (weight * determinant[:, q])[:, None, None] * elasticity[material] @ strain
            result += strain.transpose(0, 2, 1) @ stress
        return result

    def gradients(self, corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the gradients ``(ne, q, k, 3)`` [1/m] and Jacobian determinants ``(ne, q)`` [m^3]."""
        jacobian = np.einsum("eai,qad->eqid", corners, self.derivatives, optimize=True)
        determinant = np.linalg.det(jacobian)
        regular = np.where((determinant == 0.0)[..., None, None], np.eye(3), jacobian)
        return self.derivatives @ np.linalg.inv(regular), determinant


TETRAHEDRON = Tetrahedron("tetrahedron", BARYCENTRIC[None], np.full(1, 1.0 / 6.0), LINEAR_SHARE)
TETRAHEDRON_QUADRATIC = Tetrahedron(
    "tetrahedron_quadratic", quadratic_derivatives(CUBIC_POINTS), CUBIC_WEIGHTS, QUADRATIC_SHARE
)
