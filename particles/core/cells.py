"""Counting sort of points into the cells of a uniform grid.

The cell (x, y, z) of a grid with n_y and n_z cells along y and z has the number (x n_y + y) n_z + z: cells that follow
each other along z follow each other in memory. Points of one cell keep their order, so the result depends neither on
the number of threads nor on the device. ``cuda_cells.py`` sorts on a GPU.
"""

from math import inf, isfinite
from typing import NamedTuple

import numpy as np
from numba import get_num_threads, njit, prange

from reflowshock.arrays import Floats, Indices

# Functions that allocate no arrays need no reference counts, for which threads would wait for each other.
uncounted = njit(cache=True, _nrt=False)


class CellList(NamedTuple):
    """Points sorted by the cells of a uniform grid.

    Attributes:
        starts: First slot of each cell and the number of points, shape (cells + 1,).
        permutation: Number of the point in each slot, shape (n,).
        coordinates: Coordinates of the sorted points, shape (3, n) [m].
        origin: Lowest corner of the grid, shape (3,) [m].
        size: Edge length of a cell [m].
        shape: Number of cells along x, y and z, shape (3,).
    """

    starts: Indices
    permutation: Indices
    coordinates: Floats
    origin: Floats
    size: float
    shape: Indices


def sort_into_cells(points: Floats, origin: Floats, size: float, shape: Indices) -> CellList:
    """Sort points by the cells of a uniform grid; points outside the grid go to the nearest cell.

    Args:
        points: Coordinates, shape (n, 3) [m], finite.
        origin: Lowest corner of the grid, shape (3,) [m].
        size: Edge length of a cell [m].
        shape: Number of cells along x, y and z, shape (3,).

    Returns:
        Sorted points with the start of each cell; cells are numbered with z fastest.
    """
    starts, permutation, coordinates = _counting_sort(points, origin, size, shape, get_num_threads())
    return CellList(starts, permutation, coordinates, origin, size, shape)


@njit(cache=True, parallel=True)
def _counting_sort(points, origin, size, shape, parts):
    """Return starts, permutation and sorted coordinates; each thread sorts one of the parts."""
    count, cells = points.shape[0], shape[0] * shape[1] * shape[2]
    cell, fill = np.empty(count, np.int64), np.zeros((parts, cells), np.int32)
    for p in prange(parts):
        for i in range(p * count // parts, (p + 1) * count // parts):
            x, y, z = cell_of(points[i], origin, size, shape)
            cell[i] = (x * shape[1] + y) * shape[2] + z
            fill[p, cell[i]] += 1
    starts, first = np.empty(cells + 1, np.int64), 0
    for c in range(cells):
        starts[c] = first
        for p in range(parts):
            occupants = fill[p, c]
            fill[p, c] = first
            first += occupants
    starts[cells] = first
    permutation, coordinates = np.empty(count, np.int32), np.empty((3, count))
    for p in prange(parts):
        for i in range(p * count // parts, (p + 1) * count // parts):
            slot = fill[p, cell[i]]
            permutation[slot] = i
            for d in range(3):
                coordinates[d, slot] = points[i, d]
            fill[p, cell[i]] += 1
    return starts, permutation, coordinates


@uncounted
def cell_of(point, origin, size, shape):
    """Return the indices (x, y, z) of the cell that contains a point, or of the nearest cell if it is outside.

    Args:
        point: Coordinates, shape (3,) [m].
        origin: Lowest corner of the grid, shape (3,) [m].
        size: Edge length of a cell, a scalar [m].
        shape: Number of cells along x, y and z, integers, shape (3,).
    """
    x = min(max(int((point[0] - origin[0]) / size), 0), shape[0] - 1)
    y = min(max(int((point[1] - origin[1]) / size), 0), shape[1] - 1)
    z = min(max(int((point[2] - origin[2]) / size), 0), shape[2] - 1)
    return x, y, z


@njit(cache=True)
def extent(points):
    """Return the extent of points, shape (n, 3), and the number of points that are not finite.

    Args:
        points: Coordinates, shape (n, 3), in any unit, which the extent has, too.

    Returns:
        Lowest coordinates (x, y, z), highest coordinates (x, y, z), and number of points with an infinite coordinate or
        NaN.
    """
    (low_x, low_y, low_z), (high_x, high_y, high_z), not_finite = (inf, inf, inf), (-inf, -inf, -inf), 0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        not_finite += not isfinite(x + y + z)
        low_x, low_y, low_z = min(low_x, x), min(low_y, y), min(low_z, z)
        high_x, high_y, high_z = max(high_x, x), max(high_y, y), max(high_z, z)
    return (low_x, low_y, low_z), (high_x, high_y, high_z), not_finite
