"""Weights of the linear basis: full derivatives of the MLS shape functions, as Hu et al. print them (eqs 11, 21-23).

The gradient converges; the Laplacian does not (its relative error stays at every spacing).
"""

import numpy as np
from numba import njit

from reflowshock.particles.core.cholesky import factor_spd, substitute


@njit(cache=True)
def linear_weights(rows, points, offsets, indices, support):
    """First and second derivatives of the linear MLS shape functions at the particle, columns as above.

    psi_J = b . p_J w_J with M b = p; derivatives of b from M b,i = p,i - M,i b and
    M b,ii = -2 M,i b,i - M,ii b (Belytschko et al. 1996). Offsets are in units of the support radius.
    """
    pair = np.zeros((indices.shape[0], 4))
    own = np.zeros((rows.shape[0], 4))
    order = np.zeros(rows.shape[0], np.int8)
    for r in range(rows.shape[0]):
        i = rows[r]
        moments = np.zeros((7, 4, 4))
        derivative = np.zeros(7)
        offset, basis = np.zeros(3), np.ones(4)
        for k in range(offsets[i], offsets[i + 1] + 1):
            j = indices[k] if k < offsets[i + 1] else i
            _weight_derivatives(points, (i, j), support, offset, derivative)
            basis[1:] = offset
            for m in range(7):
                for a in range(4):
                    for b in range(4):
                        moments[m, a, b] += derivative[m] * basis[a] * basis[b]
        coefficients = _linear_coefficients(moments)
        if coefficients.shape[0] == 0:
            continue
        order[r] = 1
        for k in range(offsets[i], offsets[i + 1] + 1):
            j = indices[k] if k < offsets[i + 1] else i
            _weight_derivatives(points, (i, j), support, offset, derivative)
            basis[1:] = offset
            target = pair[k] if k < offsets[i + 1] else own[r]
            for c in range(3):
                first = coefficients[1 + c] @ basis
                value = coefficients[0] @ basis
                target[c] = (first * derivative[0] + value * derivative[1 + c]) / support
                second = coefficients[4 + c] @ basis
                target[3] += (
                    second * derivative[0] + 2.0 * first * derivative[1 + c] + value * derivative[4 + c]
                ) / support**2
    return pair, own, order


@njit(cache=True)
def _weight_derivatives(points, pair, support, offset, derivative):
    """Weight (1 - q^2)^3 and its derivatives with respect to the position of i: w, w,x w,y w,z, w,xx w,yy w,zz."""
    i, j = pair
    square = 0.0
    for d in range(3):
        offset[d] = (points[j, d] - points[i, d]) / support
        square += offset[d] * offset[d]
    rest = max(1.0 - square, 0.0)
    derivative[0] = rest**3
    for d in range(3):
        derivative[1 + d] = 6.0 * rest**2 * offset[d]
        derivative[4 + d] = 24.0 * rest * offset[d] ** 2 - 6.0 * rest**2


@njit(cache=True)
def _linear_coefficients(moments):
    """b, b,x b,y b,z, b,xx b,yy b,zz as rows (7, 4); no rows where the moment matrix is singular.

    The origin of the basis stays at the particle, so p = (1, 0, 0, 0), p,c = e_c and p_J is constant.
    """
    result = np.zeros((7, 4))
    factor = moments[0].copy()
    if not factor_spd(factor, 4):
        return np.zeros((0, 4))
    right = np.zeros((4, 1))
    right[0, 0] = 1.0
    substitute(factor, right, 4)
    result[0] = right[:, 0]
    for c in range(3):
        right[:, 0] = -(moments[1 + c] @ result[0])
        right[1 + c, 0] += 1.0
        substitute(factor, right, 4)
        result[1 + c] = right[:, 0]
    for c in range(3):
        right[:, 0] = -2.0 * (moments[1 + c] @ result[1 + c]) - moments[4 + c] @ result[0]
        substitute(factor, right, 4)
        result[4 + c] = right[:, 0]
    return result
