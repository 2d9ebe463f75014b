"""Neighbour lists: cell grid, compressed rows, Verlet skin."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from reflowshock.arrays import Indices

Points = NDArray[np.float64]

# Cells in a radius. Three of four visited pairs are too far apart to be neighbours; with one cell, five of six.
REACH = 2


@njit(cache=True)
def _sort_into_cells(points, origin, size, shape):
    """Counting sort of the points into cells.

    Returns the first index of each cell, the points in cell order, the cell of each point with its place in that order,
    and where the points in that order are.
    """
    count = points.shape[0]
    cell = np.empty((count, 4), np.int32)
    start = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int32)
    for i in range(count):
        for d in range(3):
            cell[i, d] = min(max(int((points[i, d] - origin[d]) / size), 0), shape[d] - 1)
        start[(cell[i, 0] * shape[1] + cell[i, 1]) * shape[2] + cell[i, 2] + 1] += 1
    for c in range(1, start.shape[0]):
        start[c] += start[c - 1]
    order, places = np.empty(count, np.int32), np.empty((count, 3))
    fill = start.copy()
    for i in range(count):
        c = (cell[i, 0] * shape[1] + cell[i, 1]) * shape[2] + cell[i, 2]
        cell[i, 3] = fill[c]
        order[fill[c]] = i
        places[fill[c]] = points[i]
        fill[c] += 1
    return start, order, cell, places


@njit(cache=True)
def _visit_row(i, radius, cells, found):
    """Write the neighbours of point i into found (unless it is empty) and return their number."""
    start, order, cell, places, shape, movers = cells
    own = places[cell[i, 3]]
    x, y, z, square = own[0], own[1], own[2], radius * radius
    low, high = max(cell[i, 2] - REACH, 0), min(cell[i, 2] + REACH + 1, shape[2])
    count = 0
    for cx in range(max(cell[i, 0] - REACH, 0), min(cell[i, 0] + REACH + 1, shape[0])):
        for cy in range(max(cell[i, 1] - REACH, 0), min(cell[i, 1] + REACH + 1, shape[1])):
            column = (cx * shape[1] + cy) * shape[2]
            for k in range(start[column + low], start[column + high]):
                dx, dy, dz = x - places[k, 0], y - places[k, 1], z - places[k, 2]
                if dx * dx + dy * dy + dz * dz < square:
                    j = order[k]
                    if j != i and (i < movers or j < movers):
                        if found.shape[0] > 0:
                            found[count] = j
                        count += 1
    return count


@njit(cache=True, parallel=True)
def _rows(count, radius, cells):
    """Compressed rows of the first `count` points: one pass counts, the other writes."""
    nothing = np.empty(0, np.int32)
    offsets = np.zeros(count + 1, np.int32)
    for i in prange(count):
        offsets[i + 1] = _visit_row(i, radius, cells, nothing)
    for i in range(count):
        offsets[i + 1] += offsets[i]
    indices = np.empty(offsets[count], np.int32)
    for i in prange(count):
        _visit_row(i, radius, cells, indices[offsets[i] : offsets[i + 1]])
    return offsets, indices


def find_neighbours(
    points: Points, radius: float, movers: int | None = None, rows: int | None = None
) -> tuple[Indices, Indices]:
    """Find all pairs closer than a radius.

    Args:
        points: `(n, 3)` [m], finite.
        radius: search radius [m].
        movers: how many points, the first ones, move; pairs of two others are left out. All where it is None.
        rows: how many points, the first ones, have a row. All where it is None.

    Returns:
        offsets `(rows + 1,)` and indices: row i lists the neighbours of point i, itself left out.

    Raises:
        FloatingPointError: a coordinate is not finite.
    """
    if not np.isfinite(points).all():
        raise FloatingPointError("find_neighbours: a particle position is not finite")
    origin = points.min(axis=0)
    size = radius / REACH
    shape = np.maximum(((points.max(axis=0) - origin) / size).astype(np.int64) + 1, 1)
    moving = len(points) if movers is None else movers
    cells = (*_sort_into_cells(points, origin, size, shape), shape, moving)
    return _rows(len(points) if rows is None else rows, radius, cells)


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
        if len(points) == len(self._built_at):
            moved = np.sqrt(((points - self._built_at) ** 2).sum(axis=1).max())
            if moved <= 0.5 * self.skin:
                return
        self.offsets, self.indices = find_neighbours(points, self.radius + self.skin)
        self._built_at = points.copy()
        self.builds += 1
