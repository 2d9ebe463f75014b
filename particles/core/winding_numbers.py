"""Winding numbers of a closed triangulated surface: at points by solid angles, at grid nodes by ray casting.

The winding number of a node is the sum of the signed crossings of the surface with the vertical ray above it. It does
not depend on the nearest triangle, so it stays correct where the surface is folded or sheets of it have crossed, as
they do for some steps where a narrow groove closes. ``on_grid`` fills an array; ``WindingNumbers`` stores only the
crossings on a grid without bounds.
"""

from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from numba import njit, prange

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.cells import uncounted


@uncounted
def _edge_side(points, a, b, x, y):
    """Return 1 or -1 if the edge a-b, seen from above, crosses y to the right of x (upwards or downwards), else 0.

    An edge crosses y if one end is above y and the other is not, so a ray through an edge or a vertex counts once. Both
    triangles of an edge get the same answer with opposite signs.
    """
    if (points[a, 1] <= y) == (points[b, 1] <= y):
        return 0
    low, high, sign = (a, b, 1) if points[a, 1] <= y else (b, a, -1)
    width, height = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
    return sign if width * (y - points[low, 1]) > height * (x - points[low, 0]) else 0


@uncounted
def _crossing(points, a, b, c, column):
    """Return 1, -1 or 0 if the vertical at (x, y) leaves the body through a triangle, enters or misses; and the height.

    The height is limited to the range of the triangle: a steep triangle has hardly any area seen from above, so that
    rounding matters.
    """
    x, y = column
    sign = _edge_side(points, a, b, x, y) + _edge_side(points, b, c, x, y) + _edge_side(points, c, a, x, y)
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
    """Return the range of nodes along an axis that a triangle may reach, its end excluded."""
    a, b, c = points[corners[0], axis], points[corners[1], axis], points[corners[2], axis]
    first, last = (min(a, b, c) - origin[axis]) / spacing, (max(a, b, c) - origin[axis]) / spacing
    return floor(first), ceil(last) + 1


@njit(cache=True)
def on_grid(points, triangles, origin, spacing, numbers):
    """Compute the winding numbers of a closed surface at the nodes of a grid and add them to an array.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
        origin: Position of the first node, shape (3,) [m].
        spacing: Distance between nodes, a scalar [m].
        numbers: Output, integers, changed in place; zero at first, shape (i, j, k) along x, y and z; 1 inside and 0
            outside afterwards.
    """
    last_x, last_y, last_z = numbers.shape[0] - 1, numbers.shape[1] - 1, numbers.shape[2] - 1
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
                    numbers[column, row, below] += sign
    for column in range(last_x + 1):
        for row in range(last_y + 1):
            for level in range(last_z - 1, -1, -1):
                numbers[column, row, level] += numbers[column, row, level + 1]


@njit(cache=True)
def _crossings(points, triangles, grid, keys, signs):
    """Write the node below each crossing and its sign, as far as there is room; return the number of crossings.

    ``grid``: Origin (3,), spacing, and nodes along y and z. Numbers of nodes grow downwards, then from column to
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
class WindingNumbers:
    """Winding numbers of a surface at the nodes of a grid without bounds.

    Attributes:
        origin: Node below all vertices along each axis, shape (3,) [m].
        spacing: Distance between nodes [m].
        shape: Number of nodes along y and z that cover the surface.
        keys: Nodes from which downwards the winding number changes, column after column, shape (k,).
        numbers: Winding number from each of these nodes down to the next one of its column, shape (k,).
    """

    origin: Floats
    spacing: float
    shape: tuple[int, int]
    keys: Indices
    numbers: Indices

    @classmethod
    def of(cls, points: Floats, triangles: Indices, spacing: float) -> "WindingNumbers":
        """Compute the winding numbers of a closed surface.

        Args:
            points: Vertices, shape (n, 3) [m].
            triangles: Outward oriented triangles, shape (t, 3).
            spacing: Distance between nodes [m].
        """
        low, high = points.min(axis=0), points.max(axis=0)
        origin = low - 1.5 * spacing
        _, rows, levels = (int(count) for count in np.ceil((high - origin) / spacing) + 2.0)
        grid, none = (origin, spacing, rows, levels), np.empty(0, np.int64)
        keys = np.empty(_crossings(points, triangles, grid, none, none), np.int64)
        signs = np.empty_like(keys)
        _crossings(points, triangles, grid, keys, signs)
        order = np.argsort(keys, kind="stable")
        keys, total = keys[order], np.cumsum(signs[order])
        first = np.searchsorted(keys, keys // levels * levels)  # the first key of its column
        numbers = total - np.append(0, total)[first]
        last = np.append(keys[1:] != keys[:-1], np.ones(len(keys[:1]), bool))
        return cls(origin, spacing, (rows, levels), keys[last], numbers[last])

    @property
    def bounds(self) -> tuple[int, int]:
        """Least and largest winding number."""
        return int(self.numbers.min(initial=0)), int(self.numbers.max(initial=0))

    def at(self, points: Floats) -> Indices:
        """Return the winding numbers of the nodes nearest to points (n, 3) [m], shape (n,)."""
        if not len(self.keys):
            return np.zeros(len(points), np.int64)
        (rows, levels), (column, row, level) = self.shape, np.rint((points - self.origin) / self.spacing).astype(int).T
        is_outside = (column < 0) | (row < 0) | (row >= rows) | (level >= levels)
        key = (column * rows + row + 1) * levels - 1 - np.maximum(level, 0)
        above = np.searchsorted(self.keys, key, side="right") - 1
        is_below_crossing = ~is_outside & (above >= 0) & (self.keys[above] // levels == key // levels)
        return np.where(is_below_crossing, self.numbers[above], 0)


@njit(cache=True, parallel=True)
def at_points(points, corners):
    """Return the winding number of a surface at each point, shape (n,): 1 inside, 0 outside, up to rounding.

    It is the sum of the solid angles of the triangles over 4 pi (van Oosterom & Strackee 1983).

    Args:
        points: Points, shape (n, 3) [m].
        corners: Corners of the outward oriented triangles, shape (t, 3, 3) [m].
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
