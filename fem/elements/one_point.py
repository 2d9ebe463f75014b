"""One-point 8-node hexahedron with stiffness hourglass control.

A nodal field is the sum of its affine part with the mean gradient and its hourglass part P u. The mean strain gives the
stiffness V B^T C B; the hourglass part has the incompatible-modes stiffness restricted to it, K_h = P^T K P. Because K
passes the patch test, affine and hourglass parts do not couple, so coefficient 1 reproduces K exactly on any shape:
linear results do not change, and nonlinear elements evaluate the material law at one point only.
Modes as in Flanagan & Belytschko, IJNME 17 (1981), with mean gradients; their amplitudes are q = gamma^T u.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.fem.elements.kind import Geometry, strain_matrix
from reflowshock.fem.kernels.hexahedron import SIDES

HOURGLASS = np.column_stack([SIDES[:, 1] * SIDES[:, 2], SIDES[:, 2] * SIDES[:, 0], SIDES[:, 0] * SIDES[:, 1]])
HOURGLASS = np.column_stack([HOURGLASS, SIDES.prod(axis=1)]) / np.sqrt(8.0)


@dataclass(frozen=True, slots=True)
class OnePoint:
    """One-point hexahedron.

    Attributes:
        coefficient: Factor on the hourglass stiffness; 1 gives the incompatible-modes element in linear problems.
    """

    coefficient: float = 1.0
    name: str = "one_point"
    nodes: int = 8
    hourglass: bool = True

    def geometry(self, corners: NDArray[np.float64]) -> Geometry:
        """Return nodal volumes and exact mean gradients of elements with nodes at ``corners (ne, 8, 3)`` [m]."""
        return HEXAHEDRON.geometry(corners)

    def stiffness(
        self, corners: NDArray[np.float64], elasticity: NDArray[np.float64], material: NDArray[np.int32]
    ) -> NDArray[np.float64]:
        """Return mean plus hourglass stiffness ``(ne, 24, 24)`` [N/m]."""
        geometry = HEXAHEDRON.geometry(corners)
        mean = strain_matrix(geometry.gradient)
        weighted = geometry.volume[:, None, None] * elasticity[material]
        gamma, resistance = hourglass_control(corners, elasticity, material)
        return mean.transpose(0, 2, 1) @ weighted @ mean + self.coefficient * transform_modes(gamma, resistance)


def hourglass_control(
    corners: NDArray[np.float64], elasticity: NDArray[np.float64], material: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the hourglass modes of hexahedra and their stiffness.

    Args:
        corners: Node positions of each element in tensor order, shape (ne, 8, 3) [m].
        elasticity: Elasticity of each material, shape (nm, 6, 6) [Pa].
        material: Index of each element into ``elasticity``, shape (ne,).

    Returns:
        Modes gamma, shape (ne, 8, 4), orthogonal to affine fields, with amplitudes ``q_ki = sum_a gamma_ak u_ai``; and
        the symmetric stiffness H of the amplitudes, index 3k + i, shape (ne, 12, 12) [N/m]. The nodal force is
        ``f_ai = sum_k gamma_ak (H q)_ki``.
    """
    gradient = HEXAHEDRON.geometry(corners).gradient
    gamma = HOURGLASS - gradient @ (corners.transpose(0, 2, 1) @ HOURGLASS)
    centred = corners - corners.mean(axis=1, keepdims=True)
    shape = HOURGLASS - centred @ (gradient.transpose(0, 2, 1) @ HOURGLASS)
    dual = shape @ np.linalg.inv(gamma.transpose(0, 2, 1) @ shape)
    stiffness = HEXAHEDRON.stiffness(corners, elasticity, material)
    return gamma, transform_modes(dual.transpose(0, 2, 1), stiffness)


def transform_modes(left: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return A matrix A^T with A the Kronecker product of ``left`` and the 3 x 3 identity, shape (ne, 3m, 3m).

    Args:
        left: Transformation of nodal values, shape (ne, m, n).
        matrix: Matrix with three components per node, shape (ne, 3n, 3n).
    """
    count, rows, columns = left.shape
    wide = np.einsum("emn,ij->eminj", left, np.eye(3)).reshape(count, 3 * rows, 3 * columns)
    return wide @ matrix @ wide.transpose(0, 2, 1)


ONE_POINT = OnePoint()
