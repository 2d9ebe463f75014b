"""The contract of the element family: what the rest of the program asks of a kind of element."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

DERIVATIVES = ((0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 0, 1), (3, 1, 0), (4, 1, 2), (4, 2, 1), (5, 0, 2), (5, 2, 0))


@dataclass(frozen=True, slots=True)
class Geometry:
    """Integrals over elements of k nodes.

    Attributes:
        nodal_volume: ``(ne, k)`` [m^3] share of each node in the volume, positive; times density the lumped mass.
        gradient: ``(ne, k, 3)`` [1/m] volume average of each shape function's gradient; gives the average strain.
        lowest: ``(ne,)`` [m^3] smallest Jacobian determinant at the points where it was looked at.
    """

    nodal_volume: NDArray[np.float64]
    gradient: NDArray[np.float64]
    lowest: NDArray[np.float64]

    @property
    def volume(self) -> NDArray[np.float64]:
        """Return ``(ne,)`` [m^3]."""
        return self.nodal_volume.sum(axis=1)


class ElementKind(Protocol):
    """A kind of element: its integrals and its linear stiffness."""

    @property
    def name(self) -> str:
        """Return what case files call it."""

    @property
    def nodes(self) -> int:
        """Return the number of nodes of an element, k."""

    @property
    def hourglass(self) -> bool:
        """Return whether a part of the stiffness resists modes that the integration points do not see."""

    def geometry(self, corners: NDArray[np.float64]) -> Geometry:
        """Return the integrals over elements with nodes at ``corners (ne, k, 3)`` [m], also of inverted ones."""

    def stiffness(
        self, corners: NDArray[np.float64], elasticity: NDArray[np.float64], material: NDArray[np.int32]
    ) -> NDArray[np.float64]:
        """Return the stiffness of each element, unknowns node by node.

        Args:
            corners: ``(ne, k, 3)`` [m].
            elasticity: ``(nm, 6, 6)`` [Pa].
            material: ``(ne,)`` index into ``elasticity``.

        Returns:
            ``(ne, 3k, 3k)`` [N/m].
        """


def strain_matrix(gradient: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return B of strain = B u, from gradients ``(..., k, 3)`` [1/m]: ``(..., 6, 3k)``, u node by node."""
    *outer, nodes, _ = gradient.shape
    matrix = np.zeros((*outer, 6, nodes, 3))
    for row, component, direction in DERIVATIVES:
        matrix[..., row, :, component] = gradient[..., direction]
    return matrix.reshape(*outer, 6, 3 * nodes)
