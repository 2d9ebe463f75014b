"""Weights of moving least squares: values and derivatives of the linear basis, derivatives of the quadratic one.

Linear (Hu et al., eqs 11, 21-23): the shape functions average, they do not interpolate; the gradient converges, the
Laplacian does not (its relative error stays at every spacing). Quadratic: a Taylor expansion to second order about the
particle, fitted to differences (generalised finite differences); the gradient is of order 2, the Laplacian of order 1
(2 on symmetric stencils). The small dense systems of a stencil are solved by Cholesky factors.
"""

import numpy as np
from numba import njit

PIVOT_FLOOR = 1e-9


@njit(cache=True)
def factor_spd(matrix, size):
    """Cholesky factor in place, lower triangle; False where a pivot vanishes (too few neighbours)."""
    floor = 0.0
    for a in range(size):
        floor = max(floor, PIVOT_FLOOR * matrix[a, a])
    for a in range(size):
        for b in range(a + 1):
            for c in range(b):
                matrix[a, b] -= matrix[a, c] * matrix[b, c]
            if b < a:
                matrix[a, b] /= matrix[b, b]
        if matrix[a, a] <= floor:
            return False
        matrix[a, a] = np.sqrt(matrix[a, a])
    return True


@njit(cache=True)
def substitute(factor, right, size):
    """Solve in place for all columns of right with a Cholesky factor."""
    for col in range(right.shape[1]):
        for a in range(size):
            for c in range(a):
                right[a, col] -= factor[a, c] * right[c, col]
            right[a, col] /= factor[a, a]
        for a in range(size - 1, -1, -1):
            for c in range(a + 1, size):
                right[a, col] -= factor[c, a] * right[c, col]
            right[a, col] /= factor[a, a]


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


@njit(cache=True)
def linear_weights(rows, points, offsets, indices, support):
    """First and second derivatives of the linear MLS shape functions at the particle; columns as below.

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


@njit(cache=True)
def _offset_and_weight(points, i, j, support, offset):
    """Scaled offset (written) and weight (1 - q^2)^3 of a pair, zero from the support radius on."""
    square = 0.0
    for d in range(3):
        offset[d] = (points[j, d] - points[i, d]) / support
        square += offset[d] * offset[d]
    return (1.0 - square) ** 3 if square < 1.0 else 0.0


@njit(cache=True)
def _taylor(d, basis):
    """Taylor monomials of an offset d (3,), without the constant: linear terms, then second-order ones."""
    basis[0], basis[1], basis[2] = d[0], d[1], d[2]
    basis[3], basis[4], basis[5] = 0.5 * d[0] * d[0], 0.5 * d[1] * d[1], 0.5 * d[2] * d[2]
    basis[6], basis[7], basis[8] = d[0] * d[1], d[0] * d[2], d[1] * d[2]


@njit(cache=True)
def _taylor_moment(points, row, support, size, moment):
    """Sum of weight times outer product of the first monomials over a row of neighbours (lower triangle)."""
    i, neighbours = row
    basis, offset = np.empty(9), np.empty(3)
    moment[:, :] = 0.0
    for k in range(neighbours.shape[0]):
        weight = _offset_and_weight(points, i, neighbours[k], support, offset)
        _taylor(offset, basis)
        for a in range(size):
            for b in range(a + 1):
                moment[a, b] += weight * basis[a] * basis[b]


@njit(cache=True)
def _wanted(support, size, right):
    """Right-hand sides: the coefficients of d/dx, d/dy, d/dz and the Laplacian; the latter needs all nine."""
    right[:, :] = 0.0
    for c in range(3):
        right[c, c] = 1.0 / support
        if size == 9:
            right[3 + c, 3] = 1.0 / support**2


@njit(cache=True)
def quadratic_weights(rows, points, offsets, indices, support):
    """Difference weights per pair and their negative sum at the particle; columns: d/dx, d/dy, d/dz, Laplacian.

    A row whose neighbours do not determine the quadratic terms falls back to the linear ones; its order says so.
    """
    pair = np.zeros((indices.shape[0], 4))
    own = np.zeros((rows.shape[0], 4))
    order = np.zeros(rows.shape[0], np.int8)
    basis, offset = np.empty(9), np.empty(3)
    moment, right = np.empty((9, 9)), np.empty((9, 4))
    for r in range(rows.shape[0]):
        i = rows[r]
        for size in (9, 3):
            _taylor_moment(points, (i, indices[offsets[i] : offsets[i + 1]]), support, size, moment)
            if factor_spd(moment, size):
                order[r] = 2 if size == 9 else 1
                _wanted(support, size, right)
                substitute(moment, right, size)
                break
        if order[r] == 0:
            continue
        for k in range(offsets[i], offsets[i + 1]):
            weight = _offset_and_weight(points, i, indices[k], support, offset)
            _taylor(offset, basis)
            for c in range(4):
                pair[k, c] = weight * (basis * right[:, c]).sum()
                own[r, c] -= pair[k, c]
    return pair, own, order
