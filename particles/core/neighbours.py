"""Neighbour lists: cell grid, compressed rows, Verlet skin."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import inf, isfinite
from typing import Any

import numpy as np
from numba import get_num_threads, njit, prange
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices

Points = NDArray[np.float64]

# Cells in a radius. Three of four visited pairs are too far apart to be neighbours; with one cell, five of six.
REACH = 2
# Rows that are made at once.
BLOCK = 8192
# Rows of equal length have at least so many places, and the so manieth part more than they need.
FEWEST, SPARE = 32, 8
# What makes no arrays counts no references to those it is given, on which threads would wait for each other.
uncounted = njit(cache=True, _nrt=False)


@njit(cache=True, parallel=True)
def _sort_into_cells(points, origin, size, shape, parts):
    """Counting sort of the points into cells: first index of each cell, which point is where, and their places there.

    Cells that follow each other along z follow each other in memory, points of a cell in their order: that does not
    depend on the number of parts, which threads sort.
    """
    count, cells = points.shape[0], shape[0] * shape[1] * shape[2]
    cell, fill = np.empty(count, np.int64), np.zeros((parts, cells), np.int32)
    for p in prange(parts):
        for i in range(p * count // parts, (p + 1) * count // parts):
            x, y, z = cell_of(points[i], origin, size, shape)
            cell[i] = (x * shape[1] + y) * shape[2] + z
            fill[p, cell[i]] += 1
    start, first = np.empty(cells + 1, np.int64), 0
    for c in range(cells):
        start[c] = first
        for p in range(parts):
            here = fill[p, c]
            fill[p, c] = first
            first += here
    start[cells] = first
    order, places = np.empty(count, np.int32), np.empty((3, count))
    for p in prange(parts):
        for i in range(p * count // parts, (p + 1) * count // parts):
            k = fill[p, cell[i]]
            order[k] = i
            for d in range(3):
                places[d, k] = points[i, d]
            fill[p, cell[i]] += 1
    return start, order, places


@uncounted
def cell_of(place, origin, size, shape):
    """Cell of a place, the nearest one where it is outside the grid."""
    x = min(max(int((place[0] - origin[0]) / size), 0), shape[0] - 1)
    y = min(max(int((place[1] - origin[1]) / size), 0), shape[1] - 1)
    z = min(max(int((place[2] - origin[2]) / size), 0), shape[2] - 1)
    return x, y, z


@uncounted
def _columns(place, grid):
    """Cells around a place: first and last along x, y and z, the last one excluded."""
    _, _, _, origin, size, shape = grid
    x, y, z = cell_of(place, origin, size, shape)
    along_x = max(x - REACH, 0), min(x + REACH + 1, shape[0])
    along_y = max(y - REACH, 0), min(y + REACH + 1, shape[1])
    return along_x, along_y, (max(z - REACH, 0), min(z + REACH + 1, shape[2]))


@uncounted
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


@uncounted
def visit(place, left_out, radius, grid, found):
    """Write the points near a place into found and return their number; where there are more than room, not the rest.

    ``left_out``: a point that is not listed, and the first of those that are not. ``grid``: as `_sort_into_cells`
    returns it, with the grid's origin, the size and numbers of its cells.
    """
    start, order, places, shape = grid[0], grid[1], grid[2], grid[5]
    x, y, z = place[0], place[1], place[2]
    own, end = left_out
    along_x, along_y, (low, high) = _columns(place, grid)
    count, last, limit = 0, found.shape[0] - 1, radius * radius
    for ix in range(*along_x):
        for iy in range(*along_y):
            column = (ix * shape[1] + iy) * shape[2]
            for k in range(start[column + low], start[column + high]):
                dx, dy, dz = x - places[0, k], y - places[1, k], z - places[2, k]
                j = order[k]
                # Without a branch: the next one takes the place where this one is too far away.
                found[count if count < last else last] = j
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
        offsets[r + 1] = visit(places[i], left_out, radius, grid, found[room[r] : room[r + 1]])
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


@njit(cache=True, parallel=True)
def _fill_rows(places, radius, grid, rows, counts):
    """Write who of a grid is near each place into rows of equal length, how many into counts; the largest of these."""
    points, most = grid[1].shape[0], 0
    for i in prange(places.shape[0]):
        counts[i] = visit(places[i], (np.int64(-1), points), radius, grid, rows[i])
        most = max(most, counts[i])
    return most


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


def list_beside(places: Points, points: Points, radius: float, movers: int, rows: Indices) -> tuple[Indices, Indices]:
    """Find what `find_beside` finds, in rows of equal length.

    Args:
        places: `(m, 3)` [m], finite.
        points: `(n, 3)` [m], finite.
        radius: search radius [m].
        movers: as for `find_beside`.
        rows: `(m, k)` those of the last time, which are taken again where they are long enough.

    Returns:
        rows `(m, k)` and how many points each begins with `(m,)`.

    Raises:
        FloatingPointError: a coordinate is not finite.
    """
    grid, counts, most = _grid(places, points, radius), np.empty(len(places), np.int32), rows.shape[1]
    sides = [(slice(movers), grid)]
    if movers < len(places):  # the same cells without the other points, which few of the other places are near
        sides.append((slice(movers, None), _with_points(points[:movers], *grid[3:])))
    if len(rows) == len(places) and most:
        most = _fill(sides, places, radius, rows, counts)
    while len(rows) != len(places) or most >= rows.shape[1]:  # the last place of a row is there for what does not fit
        rows = np.empty((len(places), max(most + most // SPARE + 1, FEWEST)), np.int32)
        most = _fill(sides, places, radius, rows, counts)
    return rows, counts


def _fill(
    sides: Sequence[tuple[slice, tuple[Any, ...]]], places: Points, radius: float, rows: Indices, counts: Indices
) -> int:
    """Fill the rows of places from the grid that each side of them sees; return the largest count."""
    return max(_fill_rows(places[side], radius, grid, rows[side], counts[side]) for side, grid in sides)


def _grid(places: Points, points: Points, radius: float) -> tuple[Any, ...]:
    """Points in cells of which `REACH` are a radius wide."""
    low, high, astray = _extent(points)
    if astray or _extent(places)[2]:
        raise FloatingPointError("find_neighbours: a particle position is not finite")
    origin, size = np.array(low), radius / REACH
    return _with_points(points, origin, size, ((np.array(high) - origin) / size).astype(np.int64) + 1)


def _with_points(points: Points, origin: Points, size: float, shape: Indices) -> tuple[Any, ...]:
    """Points in the cells of a grid."""
    return (*_sort_into_cells(points, origin, size, shape, get_num_threads()), origin, size, shape)


@njit(cache=True)
def _extent(points):
    """Least and largest coordinates of points `(n, 3)`, and how many are not finite."""
    (low_x, low_y, low_z), (high_x, high_y, high_z), astray = (inf, inf, inf), (-inf, -inf, -inf), 0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        astray += not isfinite(x + y + z)
        low_x, low_y, low_z = min(low_x, x), min(low_y, y), min(low_z, z)
        high_x, high_y, high_z = max(high_x, x), max(high_y, y), max(high_z, z)
    return (low_x, low_y, low_z), (high_x, high_y, high_z), astray


def have_moved(points: Sequence[Floats] | Floats, built_at: Sequence[Floats] | Floats, skin: float) -> bool:
    """Whether a list made of other places may lack pairs: one has moved by half a skin or more from all.

    What moves all of them alike changes no distance. ``points`` and ``built_at`` have x, y and z of all, `(3, n)`.
    """
    x, y, z = map(np.ascontiguousarray, points)  # one kernel for all layouts
    before_x, before_y, before_z = map(np.ascontiguousarray, built_at)
    return _have_moved((x, y, z), (before_x, before_y, before_z), skin)


@njit(cache=True)
def _have_moved(points, built_at, skin):
    """`have_moved` of three arrays each."""
    count, (low_x, low_y, low_z), (high_x, high_y, high_z) = len(points[0]), (inf, inf, inf), (-inf, -inf, -inf)
    for i in range(count):
        x, y, z = points[0][i] - built_at[0][i], points[1][i] - built_at[1][i], points[2][i] - built_at[2][i]
        low_x, low_y, low_z = min(low_x, x), min(low_y, y), min(low_z, z)
        high_x, high_y, high_z = max(high_x, x), max(high_y, y), max(high_z, z)
    mean_x, mean_y, mean_z = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y), 0.5 * (low_z + high_z)
    far = 0
    for i in range(count):
        x, y, z = points[0][i] - built_at[0][i], points[1][i] - built_at[1][i], points[2][i] - built_at[2][i]
        square = (x - mean_x) ** 2 + (y - mean_y) ** 2 + (z - mean_z) ** 2
        far += not square <= (0.5 * skin) ** 2  # what is no number has moved, too
    return far > 0


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
        if len(points) == len(self._built_at) and not have_moved(points.T, self._built_at.T, self.skin):
            return
        self.offsets, self.indices = find_neighbours(points, self.radius + self.skin)
        self._built_at = points.copy()
        self.builds += 1
