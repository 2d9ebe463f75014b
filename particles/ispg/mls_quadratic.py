"""Weights of the quadratic basis: Taylor expansion to second order about the particle, fitted to differences.

Generalised finite differences: the gradient is of order 2, the Laplacian of order 1 (2 on symmetric stencils).
"""

import numpy as np
from numba import njit

from reflowshock.particles.core.cholesky import factor_spd, substitute


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
