"""Neighbour lists: cell grid, compressed rows, Verlet skin."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from reflowshock.arrays import Indices

Points = NDArray[np.float64]

# Cells in a radius. Three of four visited pairs are too far apart to be neighbours; with one cell, five of six.
REACH = 2
# Rows that are made at once.
BLOCK = 8192


@njit(cache=True)
def _sort_into_cells(points, origin, size, shape):
    """Counting sort of the points into cells: first index of each cell, which point is where, and their places there.

    Cells that follow each other along z follow each other in memory.
    """
    count = points.shape[0]
    cell = np.empty(count, np.int64)
    start = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    for i in range(count):
        x, y, z = _cell_of(points[i], origin, size, shape)
        cell[i] = (x * shape[1] + y) * shape[2] + z
        start[cell[i] + 1] += 1
    for c in range(1, start.shape[0]):
        start[c] += start[c - 1]
    order, places = np.empty(count, np.int32), np.empty((3, count))
    fill = start.copy()
    for i in range(count):
        k = fill[cell[i]]
        order[k] = i
        for d in range(3):
            places[d, k] = points[i, d]
        fill[cell[i]] += 1
    return start, order, places


@njit(cache=True)
def _cell_of(place, origin, size, shape):
    """Cell of a place, the nearest one where it is outside the grid."""
    x = min(max(int((place[0] - origin[0]) / size), 0), shape[0] - 1)
    y = min(max(int((place[1] - origin[1]) / size), 0), shape[1] - 1)
    z = min(max(int((place[2] - origin[2]) / size), 0), shape[2] - 1)
    return x, y, z


@njit(cache=True)
def _columns(place, grid):
    """Cells around a place: first and last along x, y and z, the last one excluded."""
    _, _, _, origin, size, shape = grid
    x, y, z = _cell_of(place, origin, size, shape)
    along_x = max(x - REACH, 0), min(x + REACH + 1, shape[0])
    along_y = max(y - REACH, 0), min(y + REACH + 1, shape[1])
    return along_x, along_y, (max(z - REACH, 0), min(z + REACH + 1, shape[2]))


@njit(cache=True)
def _candidates(place, grid):
    """Number of points in the cells around a place."""
    start, shape = grid[0], grid[5]
    along_x, along_y, (low, high) = _columns(place, grid)
    count = 0
    for ix in range(*along_x):
        for iy in range(*along_y):
            column = (ix * shape[1] + iy) * shape[2]
            count += start[column + high] - start[column + low]
    return count


@njit(cache=True)
def _visit(place, left_out, radius, grid, found):
    """Write the points near a place into found, which has room for all candidates, and return their number.

    ``left_out``: a point that is not listed, and the first of those that are not.
    """
    start, order, places, shape = grid[0], grid[1], grid[2], grid[5]
    x, y, z = place[0], place[1], place[2]
    own, end = left_out
    along_x, along_y, (low, high) = _columns(place, grid)
    count, limit = 0, radius * radius
    for ix in range(*along_x):
        for iy in range(*along_y):
            column = (ix * shape[1] + iy) * shape[2]
            for k in range(start[column + low], start[column + high]):
                dx, dy, dz = x - places[0, k], y - places[1, k], z - places[2, k]
                j = order[k]
                found[count] = j  # without a branch: the next one takes the place where this one is too far away
                count += (dx * dx + dy * dy + dz * dz < limit) & (j != own) & (j < end)
    return count


@njit(cache=True, parallel=True)
def _rows(rows, places, radius, grid, listed):
    """Compressed rows of some places, first and last.

    ``listed``: whether a point is listed in its own row, and how many places see all points.
    """
    (first, last), (own, movers), points = rows, listed, grid[1].shape[0]
    count = last - first
    room, offsets = np.zeros(count + 1, np.int64), np.zeros(count + 1, np.int32)
    for r in prange(count):
        room[r + 1] = _candidates(places[first + r], grid)
    room = np.cumsum(room)
    found = np.empty(room[count], np.int32)
    for r in prange(count):
        i = first + r
        left_out = (-1 if own else i, points if i < movers else movers)
        offsets[r + 1] = _visit(places[i], left_out, radius, grid, found[room[r] : room[r + 1]])
    for r in range(count):
        offsets[r + 1] += offsets[r]
    indices = np.empty(offsets[count], np.int32)
    for r in prange(count):
        indices[offsets[r] : offsets[r + 1]] = found[room[r] : room[r] + offsets[r + 1] - offsets[r]]
    return offsets, indices


def _in_blocks(
    places: Points, radius: float, grid: tuple[Any, ...], listed: tuple[bool, int]
) -> tuple[Indices, Indices]:
    """Compressed rows of all places, some thousands at a time: candidates, four times the neighbours, need room."""
    bounds = [*range(0, max(len(places), 1), BLOCK), len(places)]
    parts = [_rows(pair, places, radius, grid, listed) for pair in pairwise(bounds)]
    if len(parts) == 1:
        return parts[0]
    lengths = np.concatenate([[0], *(np.diff(offsets) for offsets, _ in parts)])
    return np.cumsum(lengths, dtype=np.int32), np.concatenate([indices for _, indices in parts])


def find_neighbours(points: Points, radius: float, rows: int | None = None) -> tuple[Indices, Indices]:
    """Find all pairs closer than a radius.

    Args:
        points: `(n, 3)` [m], finite.
        radius: search radius [m].
        rows: how many points, the first ones, have a row. All where it is None.

    Returns:
        offsets `(rows + 1,)` and indices: row i lists the neighbours of point i, itself left out.

    Raises:
        FloatingPointError: a coordinate is not finite.
    """
    return _in_blocks(points[:rows], radius, _grid(points, points, radius), (False, len(points)))


def find_beside(places: Points, points: Points, radius: float, movers: int | None = None) -> tuple[Indices, Indices]:
    """Find the points closer than a radius to each place.

    Args:
        places: `(m, 3)` [m], finite.
        points: `(n, 3)` [m], finite.
        radius: search radius [m].
        movers: how many places, the first ones, see all points; the others see as many points, the first ones. All do
            where it is None.

    Returns:
        offsets `(m + 1,)` and indices: row i lists the points near place i, also one that is there.

    Raises:
        FloatingPointError: a coordinate is not finite.
    """
    moving = max(len(places), len(points)) if movers is None else movers
    return _in_blocks(places, radius, _grid(places, points, radius), (True, moving))


def _grid(places: Points, points: Points, radius: float) -> tuple[Any, ...]:
    """Points in cells of which `REACH` are a radius wide."""
    if not (np.isfinite(points).all() and np.isfinite(places).all()):
        raise FloatingPointError("find_neighbours: a particle position is not finite")
    origin, size = points.min(axis=0), radius / REACH
    shape = (np.ptp(points, axis=0) / size).astype(np.int64) + 1
    return (*_sort_into_cells(points, origin, size, shape), origin, size, shape)


@njit(cache=True)
def have_moved(points, built_at, skin):
    """Whether a list made of other places `(n, 3)` may lack pairs: one has moved by half a skin or more from all.

    What moves all of them alike changes no distance.
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(points.shape[0]):
        for d in range(3):
            moved = points[i, d] - built_at[i, d]
            low[d], high[d] = min(low[d], moved), max(high[d], moved)
    for i in range(points.shape[0]):
        square = 0.0
        for d in range(3):
            square += (points[i, d] - built_at[i, d] - 0.5 * (low[d] + high[d])) ** 2
        if not square <= (0.5 * skin) ** 2:  # what is no number has moved, too
            return True
    return False


class NeighbourList:
    """Neighbours within a radius plus a skin, rebuilt when a particle has moved half the skin (Verlet 1967).

    The rows may hold pairs up to `radius + skin` apart: every kernel weighs a pair beyond `radius` with zero.
    """

    def __init__(self, radius: float, skin: float) -> None:
        """Set the radius and the skin [m]; the first `update` builds the list."""
        self.radius = radius
        self.skin = skin
        self.builds = 0
        self._built_at: Points = np.empty((0, 3))
        self.offsets: Indices = np.zeros(1, np.int32)
        self.indices: Indices = np.empty(0, np.int32)

    def saved(self) -> dict[str, Any]:
        """Where the list was built, for a checkpoint: it follows from that."""
        return {"built_at": self._built_at, "builds": self.builds}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self._built_at, self.builds = saved["built_at"], saved["builds"]
        if len(self._built_at):
            self.offsets, self.indices = find_neighbours(self._built_at, self.radius + self.skin)

    def update(self, points: Points) -> None:
        """Make the list valid for these points `(n, 3)` [m]."""
        if len(points) == len(self._built_at) and not have_moved(points, self._built_at, self.skin):
            return
        self.offsets, self.indices = find_neighbours(points, self.radius + self.skin)
        self._built_at = points.copy()
        self.builds += 1
