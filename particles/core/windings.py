"""How often a surface winds round points: by solid angles; for the nodes of a grid by its crossings above them, summed.

The grid is an array, or has no bounds: `Windings` keeps the crossings alone, whatever lies between parts of a surface.

The winding number does not ask which triangle is nearest. So it holds where a surface is folded, or sheets of it have
crossed, as they do for some steps where a narrow groove closes; there the nearest sheet may face the wrong way.
"""

from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from numba import njit, prange

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.cells import uncounted


@uncounted
def _passes(points, a, b, x, y):
    """Whether an edge from a to b, seen from above, passes x, y on the side of larger x: up (1), down (-1) or not (0).

    Of its ends one is above y and one is not. So what is exactly on an edge, or on a vertex however many triangles meet
    there, is as what is just beside it. Both triangles at an edge get the same answer, but for its sign.
    """
    if (points[a, 1] <= y) == (points[b, 1] <= y):
        return 0
    low, high, sign = (a, b, 1) if points[a, 1] <= y else (b, a, -1)
    width, height = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
    return sign if width * (y - points[low, 1]) > height * (x - points[low, 0]) else 0


@uncounted
def _crossing(points, a, b, c, place):
    """Whether the vertical through x, y leaves a body through a triangle (1), enters (-1) or misses it (0); where.

    Never above or below the triangle, where rounding would put it: seen from above, a steep one has hardly an area.
    """
    x, y = place
    sign = _passes(points, a, b, x, y) + _passes(points, b, c, x, y) + _passes(points, c, a, x, y)
    if sign == 0:
        return 0, 0.0
    ax, ay, az = points[a, 0], points[a, 1], points[a, 2]
    bx, by, bz = points[b, 0] - ax, points[b, 1] - ay, points[b, 2] - az
    cx, cy, cz = points[c, 0] - ax, points[c, 1] - ay, points[c, 2] - az
    area = bx * cy - by * cx
    if area == 0.0:
        return sign, az + (bz + cz) / 3.0
    second, third = ((x - ax) * cy - (y - ay) * cx) / area, (bx * (y - ay) - by * (x - ax)) / area
    height = second * bz + third * cz
    return sign, az + min(max(height, min(0.0, bz, cz)), max(0.0, bz, cz))


@uncounted
def _nodes_across(points, corners, axis, origin, spacing):
    """First and last node along an axis that a triangle may reach, the last one excluded."""
    one, two, three = points[corners[0], axis], points[corners[1], axis], points[corners[2], axis]
    first, last = (min(one, two, three) - origin[axis]) / spacing, (max(one, two, three) - origin[axis]) / spacing
    return floor(first), ceil(last) + 1


@njit(cache=True)
def on_grid(points, triangles, origin, spacing, found):
    """Add the windings round the nodes of a grid to what is found, an array of its counts."""
    last_x, last_y, last_z = found.shape[0] - 1, found.shape[1] - 1, found.shape[2] - 1
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        columns = _nodes_across(points, (a, b, c), 0, origin, spacing)
        rows = _nodes_across(points, (a, b, c), 1, origin, spacing)
        for column in range(max(0, columns[0]), min(last_x + 1, columns[1])):
            for row in range(max(0, rows[0]), min(last_y + 1, rows[1])):
                x, y = origin[0] + spacing * column, origin[1] + spacing * row
                sign, height = _crossing(points, a, b, c, (x, y))
                below = min(last_z, ceil((height - origin[2]) / spacing) - 1)
                if sign != 0 and below >= 0:
                    found[column, row, below] += sign
    for column in range(last_x + 1):
        for row in range(last_y + 1):
            for level in range(last_z - 1, -1, -1):
                found[column, row, level] += found[column, row, level + 1]


@njit(cache=True)
def _crossings(points, triangles, grid, keys, signs):
    """Write which node each crossing is above and its sign, as far as there is room; return how many there are.

    ``grid``: origin `(3,)`, spacing, and nodes along y and z: numbers of nodes grow downwards, then from column to
    column.
    """
    origin, spacing, rows, levels = grid
    count = 0
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        for column in range(*_nodes_across(points, (a, b, c), 0, origin, spacing)):
            for row in range(*_nodes_across(points, (a, b, c), 1, origin, spacing)):
                x, y = origin[0] + spacing * column, origin[1] + spacing * row
                sign, height = _crossing(points, a, b, c, (x, y))
                if sign != 0:
                    if count < keys.shape[0]:
                        below = ceil((height - origin[2]) / spacing) - 1
                        keys[count], signs[count] = (column * rows + row + 1) * levels - 1 - below, sign
                    count += 1
    return count


@dataclass(frozen=True, slots=True)
class Windings:
    """How often a surface winds round the nodes of a grid without bounds.

    Attributes:
        origin: a node below and beside all of the surface `(3,)` [m].
        spacing: of the nodes [m].
        shape: nodes along y and z beside the surface.
        keys: `(k,)` nodes below which the number changes, downwards, column after column.
        numbers: `(k,)` from each of them down to the next of its column.
    """

    origin: Floats
    spacing: float
    shape: tuple[int, int]
    keys: Indices
    numbers: Indices

    @classmethod
    def of(cls, points: Floats, triangles: Indices, spacing: float) -> "Windings":
        """Find those of a surface of points `(n, 3)` [m] and triangles `(t, 3)`."""
        low, high = points.min(axis=0), points.max(axis=0)
        origin = low - 1.5 * spacing
        _, rows, levels = (int(one) for one in np.ceil((high - origin) / spacing) + 2.0)
        grid, none = (origin, spacing, rows, levels), np.empty(0, np.int64)
        keys = np.empty(_crossings(points, triangles, grid, none, none), np.int64)
        signs = np.empty_like(keys)
        _crossings(points, triangles, grid, keys, signs)
        order = np.argsort(keys, kind="stable")
        keys, total = keys[order], np.cumsum(signs[order])
        first = np.searchsorted(keys, keys // levels * levels)  # of its column
        numbers = total - np.append(0, total)[first]
        last = np.append(keys[1:] != keys[:-1], np.ones(len(keys[:1]), bool))
        return cls(origin, spacing, (rows, levels), keys[last], numbers[last])

    @property
    def bounds(self) -> tuple[int, int]:
        """The least and the largest of all."""
        return int(self.numbers.min(initial=0)), int(self.numbers.max(initial=0))

    def about(self, places: Floats) -> Indices:
        """Return those of the nodes next to places `(n, 3)` [m], `(n,)`."""
        if not len(self.keys):
            return np.zeros(len(places), np.int64)
        (rows, levels), (column, row, level) = self.shape, np.rint((places - self.origin) / self.spacing).astype(int).T
        beside = (column < 0) | (row < 0) | (row >= rows) | (level >= levels)
        key = (column * rows + row + 1) * levels - 1 - np.maximum(level, 0)
        at = np.searchsorted(self.keys, key, side="right") - 1
        found = ~beside & (at >= 0) & (self.keys[at] // levels == key // levels)
        return np.where(found, self.numbers[at], 0)


@njit(cache=True, parallel=True)
def winding_numbers(points, corners):
    """Turns of a surface around each point, `(n,)`: 1 inside, 0 outside, up to rounding.

    Solid angles of triangles after van Oosterom & Strackee (1983).

    Args:
        points: `(n, 3)` [m].
        corners: `(t, 3, 3)` of the triangles, outward oriented [m].
    """
    result = np.zeros(points.shape[0])
    for i in prange(points.shape[0]):
        total = 0.0
        for t in range(corners.shape[0]):
            ax, ay, az = corners[t, 0] - points[i]
            bx, by, bz = corners[t, 1] - points[i]
            cx, cy, cz = corners[t, 2] - points[i]
            a, b, c = np.sqrt(ax**2 + ay**2 + az**2), np.sqrt(bx**2 + by**2 + bz**2), np.sqrt(cx**2 + cy**2 + cz**2)
            triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
            total += np.arctan2(triple, a * b * c + ab * c + bc * a + ca * b)
        result[i] = total / (2.0 * np.pi)
    return result
