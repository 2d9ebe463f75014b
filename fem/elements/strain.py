"""Strain of displacements from the gradients of shape functions; Voigt order as in ``materials``."""

import numpy as np
from numpy.typing import NDArray

DERIVATIVES = ((0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 0, 1), (3, 1, 0), (4, 1, 2), (4, 2, 1), (5, 0, 2), (5, 2, 0))


def strain_matrix(gradient: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return B of strain = B u, from gradients ``(..., k, 3)`` [1/m]: ``(..., 6, 3k)``, u node by node."""
    *outer, nodes, _ = gradient.shape
    matrix = np.zeros((*outer, 6, nodes, 3))
    for row, component, direction in DERIVATIVES:
        matrix[..., row, :, component] = gradient[..., direction]
    return matrix.reshape(*outer, 6, 3 * nodes)
