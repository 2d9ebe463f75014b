"""Moving least squares: sparse operators of the gradient and the Laplacian at particles, in two bases.

Linear (Hu et al., eqs 11 and 21 to 23): the shape functions average instead of interpolating; the gradient converges,
the Laplacian does not (its relative error is the same at every spacing). Quadratic: a second-order Taylor expansion
about the particle, fitted to differences (generalised finite differences); the gradient is of order 2, the Laplacian of
order 1, or 2 on symmetric stencils.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.ispg.stencils import DegenerateStencil, factor_spd, substitute

# Support radius in spacings; the quadratic fit needs at least 9 well distributed neighbours, at a wall, too.
SUPPORT = {"linear": 2.0, "quadratic": 2.4}


@dataclass(frozen=True, slots=True)
class Derivatives:
    """Sparse derivative operators at some particles, one row per particle.

    Attributes:
        rows: Particles, shape (m,).
        gradient: Derivatives by x, y and z, shape (m, n) each [1/m].
        laplacian: Laplacian, zero in rows of order 1 of the quadratic basis, shape (m, n) [1/m^2].
        order: Order of the polynomials that each row reproduces, shape (m,).
    """

    rows: NDArray[np.int32]
    gradient: tuple[sparse.csr_matrix, sparse.csr_matrix, sparse.csr_matrix]
    laplacian: sparse.csr_matrix
    order: NDArray[np.int8]


def fit_derivatives(points: Floats, rows: NDArray[np.int32], neighbours: NeighbourList, basis: str) -> Derivatives:
    """Fit the derivative operators at some particles.

    Args:
        points: Positions, shape (n, 3) [m].
        rows: Particles at which to fit, shape (m,).
        neighbours: Lists of the particles near each particle, within a radius that is the support of the weights.
        basis: Polynomial basis of the moving least squares fit, "linear" or "quadratic".

    Returns:
        Sparse matrices of the derivatives by x, y, z [1/m] and of the Laplacian [1/m^2], shape (m, n) each, and the
        order of the polynomials that each row reproduces, shape (m,).

    Raises:
        DegenerateStencil: A particle has too few neighbours, or they lie in a plane.
    """
    kernel = {"linear": linear_weights, "quadratic": quadratic_weights}[basis]
    pair, diagonal, order = kernel(rows, points, neighbours.offsets, neighbours.indices, neighbours.radius)
    _check_order(order, points, rows, neighbours)
    first, second, third, laplacian = _assemble(len(points), rows, neighbours, pair, diagonal)
    return Derivatives(rows, (first, second, third), laplacian, order)


def fit_shape_functions(points: Floats, rows: NDArray[np.int32], neighbours: NeighbourList) -> sparse.csr_matrix:
    """Return the linear MLS shape functions psi_J at some particles (Hu et al., eq 11); rows sum to 1.

    Args:
        points: Positions, shape (n, 3) [m].
        rows: Particles at which to fit, shape (m,).
        neighbours: Lists of the particles near each particle, within a radius that is the support of the weights.

    Returns:
        Sparse matrix, shape (m, n).

    Raises:
        DegenerateStencil: A particle has too few neighbours, or they lie in a plane.
    """
    pair, diagonal, order = shape_weights(rows, points, neighbours.offsets, neighbours.indices, neighbours.radius)
    _check_order(order, points, rows, neighbours)
    return _assemble(len(points), rows, neighbours, pair, diagonal)[0]


def _check_order(order: NDArray[np.int8], points: Floats, rows: NDArray[np.int32], neighbours: NeighbourList) -> None:
    if (order == 0).any():
        worst = rows[int(np.argmin(order))]
        raise DegenerateStencil(
            f"particle {worst} at {points[worst]} m has {np.diff(neighbours.offsets)[worst]} neighbours within "
            f"{neighbours.radius:.3g} m, or they lie in a plane: no gradient can be fitted"
        )


def _assemble(
    count: int, rows: NDArray[np.int32], neighbours: NeighbourList, pair: Floats, diagonal: Floats
) -> list[sparse.csr_matrix]:
    """Assemble one matrix, shape (m, count), for each column of the weights of pairs and of the particle itself."""
    lengths = np.diff(neighbours.offsets)[rows]
    starts = np.concatenate(([0], np.cumsum(lengths + 1)))
    first = np.cumsum(lengths) - lengths
    slot = np.repeat(neighbours.offsets[rows] - first, lengths) + np.arange(lengths.sum())
    columns = np.empty(starts[-1], np.int32)
    is_diagonal = np.zeros(starts[-1], bool)
    is_diagonal[starts[1:] - 1] = True
    columns[is_diagonal] = rows
    columns[~is_diagonal] = neighbours.indices[slot]
    matrices = []
    for c in range(pair.shape[1]):
        values = np.empty(starts[-1])
        values[is_diagonal] = diagonal[:, c]
        values[~is_diagonal] = pair[slot, c]
        matrices.append(sparse.csr_matrix((values, columns, starts), shape=(len(rows), count)))
    return matrices


@njit(cache=True)
def _basis_and_weight(points, pair, support, basis):
    """Write the linear basis at the offset of a pair over the support radius; return the weight (1 - q^2)^3."""
    i, j = pair
    basis[0] = 1.0
    square = 0.0
    for d in range(3):
        basis[1 + d] = (points[j, d] - points[i, d]) / support
        square += basis[1 + d] * basis[1 + d]
    return max(1.0 - square, 0.0) ** 3


@njit(cache=True)
def shape_weights(rows, points, offsets, indices, support):
    """Return the linear MLS shape functions psi_J = w_J p_J . M^-1 (1, 0, 0, 0) at some particles.

    Args:
        rows: Numbers of the particles at which the functions are fitted, integers, shape (m,).
        points: Positions, shape (n, 3) [m].
        offsets: Start of each particle's neighbours in ``indices``, shape (n + 1,).
        indices: Numbers of the neighbours of all particles, integers.
        support: Support radius, scalar [m].

    Returns:
        Tuple of three: weights of the neighbours of the m particles, one after the other, shape (k, 1); weights of the
        particles themselves, shape (m, 1); order of each row, 1, or 0 where M is singular, shape (m,).
    """
    pair = np.zeros((indices.shape[0], 1))
    diagonal = np.zeros((rows.shape[0], 1))
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
            value = right[0, 0] + basis[1] * right[1, 0] + basis[2] * right[2, 0] + basis[3] * right[3, 0]
            pair[k, 0] = weight * value
        diagonal[r, 0] = right[0, 0]
    return pair, diagonal, order


@njit(cache=True)
def linear_weights(rows, points, offsets, indices, support):
    """Return first derivatives and the Laplacian of the linear MLS shape functions at some particles.

    psi_J = b . p_J w_J with M b = p; derivatives of b from M b,i = p,i - M,i b and M b,ii = -2 M,i b,i - M,ii b
    (Belytschko et al. 1996). Distances are in units of the support radius.

    Args:
        rows: Numbers of the particles at which the functions are fitted, integers, shape (m,).
        points: Positions, shape (n, 3) [m].
        offsets: Start of each particle's neighbours in ``indices``, shape (n + 1,).
        indices: Numbers of the neighbours of all particles, integers.
        support: Support radius, scalar [m].

    Returns:
        Weights of the neighbours of the m particles, one after the other, shape (k, 4) [1/m, 1/m^2], and of the
        particle itself, shape (m, 4), in the columns d/dx, d/dy, d/dz and Laplacian; order, 0 where M is singular,
        shape (m,).
    """
    pair = np.zeros((indices.shape[0], 4))
    diagonal = np.zeros((rows.shape[0], 4))
    order = np.zeros(rows.shape[0], np.int8)
    for r in range(rows.shape[0]):
        i = rows[r]
        moments = np.zeros((7, 4, 4))
        derivative, basis = np.zeros(7), np.ones(4)
        for k in range(offsets[i], offsets[i + 1] + 1):
            j = indices[k] if k < offsets[i + 1] else i
            _weight_derivatives(points, (i, j), support, basis, derivative)
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
            _weight_derivatives(points, (i, j), support, basis, derivative)
            target = pair[k] if k < offsets[i + 1] else diagonal[r]
            for c in range(3):
                first, value = _product(coefficients, 1 + c, basis), _product(coefficients, 0, basis)
                target[c] = (first * derivative[0] + value * derivative[1 + c]) / support
                second = _product(coefficients, 4 + c, basis)
                target[3] += (
                    second * derivative[0] + 2.0 * first * derivative[1 + c] + value * derivative[4 + c]
                ) / support**2
    return pair, diagonal, order


@njit(cache=True)
def _product(matrix, row, vector):
    """Return the product of a row of a matrix with four columns and a vector."""
    total = 0.0
    for a in range(4):
        total += matrix[row, a] * vector[a]
    return total


@njit(cache=True)
def _weight_derivatives(points, pair, support, basis, derivative):
    """Write the weight (1 - q^2)^3 and its derivatives by the position of i: w, w,x w,y w,z, w,xx w,yy w,zz.

    The offset is written to the linear basis (1, x, y, z).
    """
    i, j = pair
    square = 0.0
    for d in range(3):
        basis[1 + d] = (points[j, d] - points[i, d]) / support
        square += basis[1 + d] * basis[1 + d]
    rest = max(1.0 - square, 0.0)
    derivative[0] = rest**3
    for d in range(3):
        derivative[1 + d] = 6.0 * rest**2 * basis[1 + d]
        derivative[4 + d] = 24.0 * rest * basis[1 + d] ** 2 - 6.0 * rest**2


@njit(cache=True)
def _linear_coefficients(moments):
    """Return b, b,x b,y b,z, b,xx b,yy b,zz as rows (7, 4), or no rows if the moment matrix is singular.

    The origin of the basis stays at the particle, so p = (1, 0, 0, 0), p,c = e_c and p_J is constant.
    """
    result = np.zeros((7, 4))
    factor = moments[0].copy()
    if not factor_spd(factor, 4):
        return np.zeros((0, 4))
    right = np.zeros((4, 1))
    right[0, 0] = 1.0
    _solve_into(result, 0, factor, right)
    for c in range(3):
        for a in range(4):
            right[a, 0] = -_product(moments[1 + c], a, result[0])
        right[1 + c, 0] += 1.0
        _solve_into(result, 1 + c, factor, right)
    for c in range(3):
        for a in range(4):
            first = _product(moments[1 + c], a, result[1 + c])
            right[a, 0] = -2.0 * first - _product(moments[4 + c], a, result[0])
        _solve_into(result, 4 + c, factor, right)
    return result


@njit(cache=True)
def _solve_into(result, row, factor, right):
    """Solve four equations with a Cholesky factor and write the solution to a row; ``right`` is overwritten."""
    substitute(factor, right, 4)
    for a in range(4):
        result[row, a] = right[a, 0]


@njit(cache=True)
def _offset_and_weight(points, i, j, support, offset):
    """Write the scaled offset of a pair; return its weight (1 - q^2)^3, zero from the support radius on."""
    square = 0.0
    for d in range(3):
        offset[d] = (points[j, d] - points[i, d]) / support
        square += offset[d] * offset[d]
    return (1.0 - square) ** 3 if square < 1.0 else 0.0


@njit(cache=True)
def _taylor(d, basis):
    """Write the Taylor monomials of an offset d (3,) without the constant: linear, then second-order terms."""
    basis[0], basis[1], basis[2] = d[0], d[1], d[2]
    basis[3], basis[4], basis[5] = 0.5 * d[0] * d[0], 0.5 * d[1] * d[1], 0.5 * d[2] * d[2]
    basis[6], basis[7], basis[8] = d[0] * d[1], d[0] * d[2], d[1] * d[2]


@njit(cache=True)
def _taylor_moment(points, row, support, size, moment):
    """Write the lower triangle of the weighted sum of outer products of the first monomials over a row."""
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
def _write_targets(support, size, right):
    """Write the right-hand sides that select d/dx, d/dy, d/dz and the Laplacian, which needs all nine monomials."""
    right[:, :] = 0.0
    for c in range(3):
        right[c, c] = 1.0 / support
        if size == 9:
            right[3 + c, 3] = 1.0 / support**2


@njit(cache=True)
def quadratic_weights(rows, points, offsets, indices, support):
    """Return the weights of derivatives by a fitted second-order Taylor expansion at some particles.

    A row whose neighbours do not determine the quadratic terms falls back to a linear fit.

    Args:
        rows: Numbers of the particles at which the expansion is fitted, integers, shape (m,).
        points: Positions, shape (n, 3) [m].
        offsets: Start of each particle's neighbours in ``indices``, shape (n + 1,).
        indices: Numbers of the neighbours of all particles, integers.
        support: Support radius, scalar [m].

    Returns:
        Weights of the neighbours of the m particles, one after the other, shape (k, 4) [1/m, 1/m^2], and their negative
        sums at the particle, shape (m, 4), in the columns d/dx, d/dy, d/dz and Laplacian; order 2, 1 or 0 of each row,
        shape (m,).
    """
    pair = np.zeros((indices.shape[0], 4))
    diagonal = np.zeros((rows.shape[0], 4))
    order = np.zeros(rows.shape[0], np.int8)
    basis, offset = np.empty(9), np.empty(3)
    moment, right = np.empty((9, 9)), np.empty((9, 4))
    for r in range(rows.shape[0]):
        i = rows[r]
        for size in (9, 3):
            _taylor_moment(points, (i, indices[offsets[i] : offsets[i + 1]]), support, size, moment)
            if factor_spd(moment, size):
                order[r] = 2 if size == 9 else 1
                _write_targets(support, size, right)
                substitute(moment, right, size)
                break
        if order[r] == 0:
            continue
        for k in range(offsets[i], offsets[i + 1]):
            weight = _offset_and_weight(points, i, indices[k], support, offset)
            _taylor(offset, basis)
            for c in range(4):
                value = 0.0
                for a in range(9):
                    value += basis[a] * right[a, c]
                pair[k, c] = weight * value
                diagonal[r, c] -= pair[k, c]
    return pair, diagonal, order
