"""Neighbour lists (Verlet 1967): points closer than a radius, found by a cell list and kept while motion is small."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
from numba import njit, prange

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.cells import CellList, cell_of, extent, sort_into_cells, uncounted

# With two cells a radius three of four visited pairs are too far apart to be neighbours; with one, five of six.
CELLS_PER_RADIUS = 2
# Candidates take four times the memory of neighbours, so rows are found in blocks.
ROWS_PER_BLOCK = 8192
# Shortest row of a neighbour table; a longer row has a spare eighth.
SHORTEST_ROW, SPARE = 32, 8


@uncounted
def _columns(point, cells):
    """Return the ranges of cells around a point along x, y and z, each with its end excluded."""
    x, y, z = cell_of(point, cells.origin, cells.size, cells.shape)
    along_x = max(x - CELLS_PER_RADIUS, 0), min(x + CELLS_PER_RADIUS + 1, cells.shape[0])
    along_y = max(y - CELLS_PER_RADIUS, 0), min(y + CELLS_PER_RADIUS + 1, cells.shape[1])
    return along_x, along_y, (max(z - CELLS_PER_RADIUS, 0), min(z + CELLS_PER_RADIUS + 1, cells.shape[2]))


@uncounted
def _count_candidates(point, cells):
    """Return the number of points in the cells around a point."""
    starts, shape = cells.starts, cells.shape
    along_x, along_y, (low, high) = _columns(point, cells)
    count = 0
    for ix in range(*along_x):
        for iy in range(*along_y):
            column = (ix * shape[1] + iy) * shape[2]
            count += starts[column + high] - starts[column + low]
    return count


@uncounted
def write_near(point, limits, radius, cells, row):
    """Write the numbers of the points near a point into a row and return their count, an integer.

    If there are more than the row has room for, the rest is counted but not written.

    Args:
        point: Coordinates (x, y, z) [m].
        limits: Tuple of two integers: number of a point that is left out (-1 for none); number from which on all points
            are left out.
        radius: Search radius, a scalar [m].
        cells: ``CellList`` of the points, with cells at least as large as the radius.
        row: Output, integers, shape (room,); its last entry may be overwritten by a point that is too far away.

    Returns:
        Number of points within the radius, possibly more than ``room``.
    """
    starts, numbers, coordinates, shape = cells.starts, cells.permutation, cells.coordinates, cells.shape
    x, y, z = point[0], point[1], point[2]
    excluded, end = limits
    along_x, along_y, (low, high) = _columns(point, cells)
    count, last, limit = 0, row.shape[0] - 1, radius * radius
    for ix in range(*along_x):
        for iy in range(*along_y):
            column = (ix * shape[1] + iy) * shape[2]
            for k in range(starts[column + low], starts[column + high]):
                dx, dy, dz = x - coordinates[0, k], y - coordinates[1, k], z - coordinates[2, k]
                j = numbers[k]
                # Without a branch: a point that is too far away is overwritten by the next one.
                row[count if count < last else last] = j
                count += (dx * dx + dy * dy + dz * dz < limit) & (j != excluded) & (j < end)
    return count


@njit(cache=True, parallel=True)
def _compressed_rows(rows, centres, radius, cells, options):
    """Return offsets and indices of the rows from the first to the last of a pair of row numbers.

    ``options``: whether a point is listed in its own row, and the number of centres that see all points.
    """
    (first, last), (lists_itself, movers), points = rows, options, cells.permutation.shape[0]
    count = last - first
    room, offsets = np.zeros(count + 1, np.int64), np.zeros(count + 1, np.int32)
    for r in prange(count):
        room[r + 1] = _count_candidates(centres[first + r], cells)
    room = np.cumsum(room)
    candidates = np.empty(room[count], np.int32)
    for r in prange(count):
        i = first + r
        limits = (-1 if lists_itself else i, points if i < movers else movers)
        offsets[r + 1] = write_near(centres[i], limits, radius, cells, candidates[room[r] : room[r + 1]])
    for r in range(count):
        offsets[r + 1] += offsets[r]
    indices = np.empty(offsets[count], np.int32)
    for r in prange(count):
        indices[offsets[r] : offsets[r + 1]] = candidates[room[r] : room[r] + offsets[r + 1] - offsets[r]]
    return offsets, indices


def _rows_in_blocks(
    centres: Floats, radius: float, cells: CellList, lists_itself: bool, movers: int
) -> tuple[Indices, Indices]:
    """Return offsets and indices of the rows of all centres."""
    bounds = [*range(0, max(len(centres), 1), ROWS_PER_BLOCK), len(centres)]
    blocks = [_compressed_rows(pair, centres, radius, cells, (lists_itself, movers)) for pair in pairwise(bounds)]
    if len(blocks) == 1:
        return blocks[0]
    lengths = np.concatenate([[0], *(np.diff(offsets) for offsets, _ in blocks)])
    return np.cumsum(lengths, dtype=np.int32), np.concatenate([indices for _, indices in blocks])


@njit(cache=True, parallel=True)
def _fill_rows(centres, radius, cells, rows, counts):
    """Write the points near each centre into rows of equal length and their number into counts; return the largest."""
    points, most = cells.permutation.shape[0], 0
    for i in prange(centres.shape[0]):
        counts[i] = write_near(centres[i], (np.int64(-1), points), radius, cells, rows[i])
        most = max(most, counts[i])
    return most


def find_neighbours(points: Floats, radius: float, rows: int | None = None) -> tuple[Indices, Indices]:
    """Find all pairs of points closer than a radius.

    Args:
        points: Coordinates, shape (n, 3) [m], finite.
        radius: Search radius [m].
        rows: Number of points, the first ones, for which a row is returned; all if None.

    Returns:
        Offsets (rows + 1,) and indices in compressed rows: row i lists the neighbours of point i without i itself.

    Raises:
        FloatingPointError: A coordinate is not finite.
    """
    return _rows_in_blocks(points[:rows], radius, _cell_list(points, points, radius), False, len(points))


def find_near(centres: Floats, points: Floats, radius: float, movers: int | None = None) -> tuple[Indices, Indices]:
    """Find the points closer than a radius to each centre.

    Args:
        centres: Coordinates, shape (m, 3) [m], finite.
        points: Coordinates, shape (n, 3) [m], finite.
        radius: Search radius [m].
        movers: Number of moving centres and points, the first of both; pairs of two fixed ones are left out.
            All move if None.

    Returns:
        Offsets (m + 1,) and indices in compressed rows: row i lists the points near centre i, coincident ones included.

    Raises:
        FloatingPointError: A coordinate is not finite.
    """
    moving = max(len(centres), len(points)) if movers is None else movers
    return _rows_in_blocks(centres, radius, _cell_list(centres, points, radius), True, moving)


def tabulate_near(
    centres: Floats, points: Floats, radius: float, movers: int, rows: Indices
) -> tuple[Indices, Indices]:
    """Find the points closer than a radius to each centre, as a table with rows of equal length.

    Args:
        centres: Coordinates, shape (m, 3) [m], finite.
        points: Coordinates, shape (n, 3) [m], finite.
        radius: Search radius [m].
        movers: Number of moving centres and points, the first of both; pairs of two fixed ones are left out.
        rows: Table of an earlier call, shape (m, k), overwritten and returned if it has room enough.

    Returns:
        Table of points, shape (m, k), and the number of valid entries of each row, shape (m,).

    Raises:
        FloatingPointError: A coordinate is not finite.
    """
    cells, counts, most = _cell_list(centres, points, radius), np.empty(len(centres), np.int32), rows.shape[1]
    groups = [(slice(movers), cells)]
    if movers < len(centres):  # fixed centres see moving points alone, few of which are near them
        groups.append((slice(movers, None), sort_into_cells(points[:movers], cells.origin, cells.size, cells.shape)))
    if len(rows) == len(centres) and most:
        most = _fill_table(groups, centres, radius, rows, counts)
    while len(rows) != len(centres) or most >= rows.shape[1]:  # the last entry of a row takes what does not fit
        rows = np.empty((len(centres), max(most + most // SPARE + 1, SHORTEST_ROW)), np.int32)
        most = _fill_table(groups, centres, radius, rows, counts)
    return rows, counts


def _fill_table(
    groups: Sequence[tuple[slice, CellList]], centres: Floats, radius: float, rows: Indices, counts: Indices
) -> int:
    """Fill the rows of each group of centres from its cell list; return the largest number of neighbours."""
    return max(_fill_rows(centres[group], radius, cells, rows[group], counts[group]) for group, cells in groups)


def _cell_list(centres: Floats, points: Floats, radius: float) -> CellList:
    """Sort points into cells whose size follows from the search radius."""
    low, high, not_finite = extent(points)
    if not_finite or extent(centres)[2]:
        raise FloatingPointError("find_neighbours: a particle position is not finite")
    origin, size = np.array(low), radius / CELLS_PER_RADIUS
    return sort_into_cells(points, origin, size, ((np.array(high) - origin) / size).astype(np.int64) + 1)


def have_moved(points: Sequence[Floats] | Floats, built_at: Sequence[Floats] | Floats, skin: float) -> bool:
    """Return whether a list built for earlier positions may lack pairs: a point has moved by half the skin or more.

    A translation of all points changes no distance and does not count.

    Args:
        points: Present coordinates as rows x, y, z, shape (3, n) [m].
        built_at: Coordinates for which the list was built, shape (3, n) [m].
        skin: Distance beyond the radius within which pairs are listed [m].

    Returns:
        True if the list must be rebuilt; False while it is complete.
    """
    x, y, z = map(np.ascontiguousarray, points)  # one kernel for all layouts
    before_x, before_y, before_z = map(np.ascontiguousarray, built_at)
    return _have_moved((x, y, z), (before_x, before_y, before_z), skin)


@njit(cache=True)
def _have_moved(points, built_at, skin):
    """Return the answer of ``have_moved`` for three arrays each."""
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
        far += not square <= (0.5 * skin) ** 2  # a displacement that is not a number counts, too
    return far > 0


class NeighbourList:
    """Neighbours within a radius plus a skin, rebuilt when a particle has moved half the skin (Verlet 1967).

    Rows may hold pairs up to ``radius + skin`` apart: every kernel gives a pair beyond ``radius`` the weight zero.

    Attributes:
        radius: Search radius [m].
        skin: Distance beyond the radius within which pairs are listed [m].
        builds: Number of times the list was built.
        offsets: First index of each row and the end, shape (n + 1,).
        indices: Neighbours in compressed rows.
    """

    def __init__(self, radius: float, skin: float) -> None:
        """Set the radius and the skin [m]; the first ``update`` builds the list."""
        self.radius = radius
        self.skin = skin
        self.builds = 0
        self._built_at: Floats = np.empty((0, 3))
        self.offsets: Indices = np.zeros(1, np.int32)
        self.indices: Indices = np.empty(0, np.int32)

    def saved(self) -> dict[str, Any]:
        """Return the data from which ``restore`` rebuilds the list, for a checkpoint."""
        return {"built_at": self._built_at, "builds": self.builds}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Rebuild the list from the data that ``saved`` returned."""
        self._built_at, self.builds = saved["built_at"], saved["builds"]
        if len(self._built_at):
            self.offsets, self.indices = find_neighbours(self._built_at, self.radius + self.skin)

    def update(self, points: Floats) -> None:
        """Rebuild the list if it may lack pairs of these points, shape (n, 3) [m]."""
        if len(points) == len(self._built_at) and not have_moved(points.T, self._built_at.T, self.skin):
            return
        self.offsets, self.indices = find_neighbours(points, self.radius + self.skin)
        self._built_at = points.copy()
        self.builds += 1
