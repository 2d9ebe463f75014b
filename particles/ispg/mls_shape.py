"""Values of the linear MLS shape functions (Hu et al., eq 11): they average, they do not interpolate."""

import numpy as np
from numba import njit

from reflowshock.particles.core.cholesky import factor_spd, substitute


@njit(cache=True)
def _basis_and_weight(points, pair, support, basis):
    """Linear basis (written) and weight (1 - q^2)^3 at the offset of a pair, in units of the support radius."""
    i, j = pair
    basis[0] = 1.0
    square = 0.0
    for d in range(3):
        basis[1 + d] = (points[j, d] - points[i, d]) / support
        square += basis[1 + d] * basis[1 + d]
    return max(1.0 - square, 0.0) ** 3


@njit(cache=True)
def shape_weights(rows, points, offsets, indices, support):
    """Weights psi_J = w_J p_J . M^-1 (1, 0, 0, 0) of pairs and of the particle itself, one column.

    The order of a row is zero where the moment matrix M is singular.
    """
    pair = np.zeros((indices.shape[0], 1))
    own = np.zeros((rows.shape[0], 1))
    order = np.zeros(rows.shape[0], np.int8)
    basis, moment, right = np.empty(4), np.empty((4, 4)), np.empty((4, 1))
    for r in range(rows.shape[0]):
        i = rows[r]
        moment[:, :] = 0.0
        for k in range(offsets[i], offsets[i + 1] + 1):
            j = indices[k] if k < offsets[i + 1] else i
            weight = _basis_and_weight(points, (i, j), support, basis)
            for a in range(4):
                for b in range(a + 1):
                    moment[a, b] += weight * basis[a] * basis[b]
        if not factor_spd(moment, 4):
            continue
        order[r] = 1
        right[:, 0] = 0.0
        right[0, 0] = 1.0
        substitute(moment, right, 4)
        for k in range(offsets[i], offsets[i + 1]):
            weight = _basis_and_weight(points, (i, indices[k]), support, basis)
            pair[k, 0] = weight * (basis * right[:, 0]).sum()
        own[r, 0] = right[0, 0]
    return pair, own, order
