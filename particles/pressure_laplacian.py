"""Compact Laplacian of the pressure between the particles below the surface: a graph of their neighbours.

On edges weighed by w, the sum of 6 V / s w (p_i - p_j) with s = sum of w r^2 is -V times the Laplacian of p
(Cummins & Rudman 1999). On the surface, which has no pressure of its own beside that of the whole body, p is zero.
"""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy import sparse

from particles.body import Body
from particles.neighbours import NeighbourList

Floats = NDArray[np.float64]


@njit(cache=True)
def _weight(points, i, j, support):
    """Weight (1 - q^2)^3 of an edge, zero from the support radius on, and its squared length."""
    square = 0.0
    for d in range(3):
        square += (points[j, d] - points[i, d]) ** 2
    q = square / (support * support)
    return ((1.0 - q) ** 3 if q < 1.0 else 0.0), square


@njit(cache=True, parallel=True)
def _moments(points, offsets, indices, support):
    """Sum of weight times squared length of each particle's edges, `(n,)` [m^2]."""
    result = np.zeros(points.shape[0])
    for i in prange(points.shape[0]):
        for k in range(offsets[i], offsets[i + 1]):
            weight, square = _weight(points, i, indices[k], support)
            result[i] += weight * square
    return result


@njit(cache=True, parallel=True)
def _rows(points, first, lists, scale, support):
    """Columns and values of the rows from particle `first` on; the last entry of a row is its diagonal."""
    offsets, indices, starts = lists
    columns = np.empty(starts[-1], np.int32)
    values = np.empty(starts[-1])
    for r in prange(points.shape[0] - first):
        i, at, total = first + r, starts[r], 0.0
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            value = 3.0 * (scale[i] + scale[j]) * _weight(points, i, j, support)[0]
            total += value
            if j >= first:
                columns[at], values[at] = j - first, -value
                at += 1
        columns[at], values[at] = r, total
    return columns, values


def pressure_laplacian(body: Body, neighbours: NeighbourList) -> sparse.csr_matrix:
    """Build the Laplacian times volume, `(m, m)` [m]: symmetric, positive definite.

    Args:
        body: the liquid body.
        neighbours: a valid list; its radius is the support of the weights.
    """
    first, offsets, indices = body.cloud.surface_count, neighbours.offsets, neighbours.indices
    scale = body.volumes / _moments(body.points, offsets, indices, neighbours.radius)
    below = np.concatenate(([0], np.cumsum(indices >= first)))
    lengths = np.diff(below[offsets[first:]]) + 1
    starts = np.concatenate(([0], np.cumsum(lengths))).astype(np.int32)
    columns, values = _rows(body.points, first, (offsets, indices, starts), scale, neighbours.radius)
    size = len(body.points) - first
    return sparse.csr_matrix((values, columns, starts), shape=(size, size))
