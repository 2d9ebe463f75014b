"""Interface of the kinds of elements."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

DERIVATIVES = ((0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 0, 1), (3, 1, 0), (4, 1, 2), (4, 2, 1), (5, 0, 2), (5, 2, 0))


@dataclass(frozen=True, slots=True)
class Geometry:
    """Integrals over elements of k nodes.

    Attributes:
        nodal_volume: Positive volume of each node, shape (ne, k) [m^3]; times density it is the lumped mass.
        gradient: Volume average of the gradient of each shape function, shape (ne, k, 3) [1/m]; gives the mean strain.
        lowest: Smallest Jacobian determinant at the integration points, shape (ne,) [m^3].
    """

    nodal_volume: NDArray[np.float64]
    gradient: NDArray[np.float64]
    lowest: NDArray[np.float64]

    @property
    def volume(self) -> NDArray[np.float64]:
        """Volume of each element, shape (ne,) [m^3]."""
        return self.nodal_volume.sum(axis=1)


class ElementKind(Protocol):
    """Kind of element with its integrals and its linear stiffness."""

    @property
    def name(self) -> str:
        """Name in case files."""

    @property
    def nodes(self) -> int:
        """Number of nodes of an element, k."""

    @property
    def hourglass(self) -> bool:
        """Whether part of the stiffness is hourglass control, for modes without strain at the integration points."""

    def geometry(self, corners: NDArray[np.float64]) -> Geometry:
        """Return the integrals over elements with nodes at ``corners (ne, k, 3)`` [m]; inverted ones raise no error."""

    def stiffness(
        self, corners: NDArray[np.float64], elasticity: NDArray[np.float64], material: NDArray[np.int32]
    ) -> NDArray[np.float64]:
        """Return the stiffness ``(ne, 3k, 3k)`` [N/m] of each element, with unknowns node by node.

        Args:
            corners: Nodes of each element, shape (ne, k, 3) [m].
            elasticity: Elasticity of each material, shape (nm, 6, 6) [Pa].
            material: Index of each element into ``elasticity``, shape (ne,).
        """


def strain_matrix(gradient: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix B of strain = B u, shape (..., 6, 3k) [1/m].

    Rows are xx, yy, zz, xy, yz, xz with engineering shear; u has the components node by node.

    Args:
        gradient: Gradients of the k shape functions, shape (..., k, 3) [1/m].
    """
    *outer, nodes, _ = gradient.shape
    matrix = np.zeros((*outer, 6, nodes, 3))
    for row, component, direction in DERIVATIVES:
        matrix[..., row, :, component] = gradient[..., direction]
    return matrix.reshape(*outer, 6, 3 * nodes)
