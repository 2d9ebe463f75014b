"""Moving least squares: weights of the gradient and of the Laplacian at a particle.

Two bases:
  linear     shape functions of the linear basis and their full derivatives, as Hu et al. print them (eqs 11, 21);
             the Laplacian does not converge (relative error 2-7 % at every spacing).
  quadratic  Taylor expansion to second order about the particle, fitted to differences (generalised finite
             differences): gradient of order 2, Laplacian of order 1 or better (2 on symmetric stencils).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import sparse

from particles.neighbours import NeighbourList

Floats = NDArray[np.float64]

# Support radius in spacings: the quadratic fit needs at least 9 well placed neighbours at a wall, too.
SUPPORT = {"linear": 2.0, "quadratic": 2.4}
PIVOT_FLOOR = 1e-9


class DegenerateStencil(ValueError):
    """A particle has too few neighbours to fit a gradient."""


@njit(cache=True)
def _solve_spd(matrix, right, size):
    """Solve in place by Cholesky for all columns of right; False where a pivot vanishes (too few neighbours)."""
    floor = 0.0
    for a in range(size):
        floor = max(floor, matrix[a, a])
    floor *= PIVOT_FLOOR
    for a in range(size):
        for b in range(a + 1):
            total = matrix[a, b]
            for c in range(b):
                total -= matrix[a, c] * matrix[b, c]
            if a == b:
                if total <= floor:
                    return False
                matrix[a, a] = np.sqrt(total)
            else:
                matrix[a, b] = total / matrix[b, b]
    for col in range(right.shape[1]):
        for a in range(size):
            for c in range(a):
                right[a, col] -= matrix[a, c] * right[c, col]
            right[a, col] /= matrix[a, a]
        for a in range(size - 1, -1, -1):
            for c in range(a + 1, size):
                right[a, col] -= matrix[c, a] * right[c, col]
            right[a, col] /= matrix[a, a]
    return True


@njit(cache=True)
def _taylor(d, basis):
    """Taylor monomials of an offset d (3,), without the constant: linear terms, then second-order ones."""
    basis[0], basis[1], basis[2] = d[0], d[1], d[2]
    basis[3], basis[4], basis[5] = 0.5 * d[0] * d[0], 0.5 * d[1] * d[1], 0.5 * d[2] * d[2]
    basis[6], basis[7], basis[8] = d[0] * d[1], d[0] * d[2], d[1] * d[2]


@njit(cache=True)
def _quadratic_weights(rows, points, offsets, indices, support):
    """Difference weights per pair and their negative sum at the particle; columns: d/dx, d/dy, d/dz, Laplacian."""
    pair = np.zeros((indices.shape[0], 4))
    own = np.zeros((rows.shape[0], 4))
    order = np.zeros(rows.shape[0], np.int8)
    basis, offset = np.empty(9), np.empty(3)
    moment, right = np.empty((9, 9)), np.empty((9, 4))
    for r in range(rows.shape[0]):
        i = rows[r]
        for size in (9, 3):
            moment[:, :] = 0.0
            right[:, :] = 0.0
            for c in range(3):
                right[c, c] = 1.0 / support
                right[3 + c, 3] = 1.0 / support**2
            if size == 3:
                right[:, 3] = 0.0
            for k in range(offsets[i], offsets[i + 1]):
                weight = _offset_and_weight(points, i, indices[k], support, offset)
                _taylor(offset, basis)
                for a in range(size):
                    for b in range(a + 1):
                        moment[a, b] += weight * basis[a] * basis[b]
            if _solve_spd(moment, right, size):
                order[r] = 2 if size == 9 else 1
                break
        if order[r] == 0:
            continue
        for k in range(offsets[i], offsets[i + 1]):
            weight = _offset_and_weight(points, i, indices[k], support, offset)
            _taylor(offset, basis)
            for c in range(4):
                for a in range(9 if order[r] == 2 else 3):
                    pair[k, c] += weight * basis[a] * right[a, c]
                own[r, c] -= pair[k, c]
    return pair, own, order


@njit(cache=True)
def _offset_and_weight(points, i, j, support, offset):
    """Scaled offset (written) and weight (1 - q^2)^3 of a pair, zero from the support radius on."""
    square = 0.0
    for d in range(3):
        offset[d] = (points[j, d] - points[i, d]) / support
        square += offset[d] * offset[d]
    return (1.0 - square) ** 3 if square < 1.0 else 0.0


@njit(cache=True)
def _linear_weights(rows, points, offsets, indices, support):
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
            _weight_derivatives(points, i, j, support, offset, derivative)
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
            _weight_derivatives(points, i, j, support, offset, derivative)
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
def _weight_derivatives(points, i, j, support, offset, derivative):
    """Weight (1 - q^2)^3 and its derivatives with respect to the position of i: w, w,x w,y w,z, w,xx w,yy w,zz."""
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
    right = np.zeros((4, 1))
    right[0, 0] = 1.0
    if not _solve_spd(factor, right, 4):
        return np.zeros((0, 4))
    result[0] = right[:, 0]
    for c in range(3):
        column = -(moments[1 + c] @ result[0])
        column[1 + c] += 1.0
        factor = moments[0].copy()
        right[:, 0] = column
        _solve_spd(factor, right, 4)
        result[1 + c] = right[:, 0]
    for c in range(3):
        column = -2.0 * (moments[1 + c] @ result[1 + c]) - moments[4 + c] @ result[0]
        factor = moments[0].copy()
        right[:, 0] = column
        _solve_spd(factor, right, 4)
        result[4 + c] = right[:, 0]
    return result


@dataclass(frozen=True, slots=True)
class Derivatives:
    """Sparse derivative operators at some particles, one row a particle.

    Attributes:
        rows: `(m,)` the particles.
        gradient: three `(m, n)` matrices, d/dx, d/dy, d/dz [1/m].
        laplacian: `(m, n)` [1/m^2]; zero in rows of order 1 of the quadratic basis.
        order: `(m,)` order of the polynomial that each row reproduces.
    """

    rows: NDArray[np.int32]
    gradient: tuple[sparse.csr_matrix, sparse.csr_matrix, sparse.csr_matrix]
    laplacian: sparse.csr_matrix
    order: NDArray[np.int8]


def derivatives(points: Floats, rows: NDArray[np.int32], neighbours: NeighbourList, basis: str) -> Derivatives:
    """Fit the derivative operators at some particles.

    Args:
        points: `(n, 3)` [m].
        rows: `(m,)` particles at which the derivatives are wanted.
        neighbours: a list whose radius is the support of the weights.
        basis: "linear" or "quadratic".

    Raises:
        DegenerateStencil: a particle has too few neighbours, or they lie in a plane.
    """
    kernel = {"linear": _linear_weights, "quadratic": _quadratic_weights}[basis]
    pair, own, order = kernel(rows, points, neighbours.offsets, neighbours.indices, neighbours.radius)
    if (order == 0).any():
        worst = rows[int(np.argmin(order))]
        raise DegenerateStencil(
            f"particle {worst} at {points[worst]} m has {np.diff(neighbours.offsets)[worst]} neighbours within "
            f"{neighbours.radius:.3g} m, or they lie in a plane: no gradient can be fitted"
        )
    lengths = np.diff(neighbours.offsets)[rows]
    starts = np.concatenate(([0], np.cumsum(lengths + 1)))
    first = np.cumsum(lengths) - lengths
    slot = np.repeat(neighbours.offsets[rows] - first, lengths) + np.arange(lengths.sum())
    columns = np.empty(starts[-1], np.int32)
    is_own = np.zeros(starts[-1], bool)
    is_own[starts[1:] - 1] = True
    columns[is_own] = rows
    columns[~is_own] = neighbours.indices[slot]
    matrices = []
    for c in range(4):
        values = np.empty(starts[-1])
        values[is_own] = own[:, c]
        values[~is_own] = pair[slot, c]
        matrices.append(sparse.csr_matrix((values, columns, starts), shape=(len(rows), len(points))))
    return Derivatives(rows, (matrices[0], matrices[1], matrices[2]), matrices[3], order)
