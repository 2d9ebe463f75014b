"""How often a surface winds round points: by solid angles; for the nodes of a grid by its crossings above them, summed.

The winding number does not ask which triangle is nearest. So it holds where a surface is folded, or sheets of it have
crossed, as they do for some steps where a narrow groove closes; there the nearest sheet may face the wrong way.
"""

from math import ceil, floor

import numpy as np
from numba import njit, prange


@njit(cache=True)
def _passes(a, b, x, y):
    """Whether an edge from a to b, seen from above, passes x, y on the side of larger x: up (1), down (-1) or not (0).

    Of its ends one is above y and one is not. So what is exactly on an edge, or on a vertex however many triangles meet
    there, is as what is just beside it. Both triangles at an edge get the same answer, but for its sign.
    """
    if (a[1] <= y) == (b[1] <= y):
        return 0
    low, high, sign = (a, b, 1) if a[1] <= y else (b, a, -1)
    return sign if (high[0] - low[0]) * (y - low[1]) > (high[1] - low[1]) * (x - low[0]) else 0


@njit(cache=True)
def _crossing(points, corners, x, y):
    """Whether the vertical through x, y leaves a body through a triangle (1), enters (-1) or misses it (0); where."""
    a, b, c = points[corners[0]], points[corners[1]], points[corners[2]]
    sign = _passes(a, b, x, y) + _passes(b, c, x, y) + _passes(c, a, x, y)
    if sign == 0:
        return 0, 0.0
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if area == 0.0:
        return sign, (a[2] + b[2] + c[2]) / 3.0
    second = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
    third = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
    return sign, a[2] + second * (b[2] - a[2]) + third * (c[2] - a[2])


@njit(cache=True)
def on_grid(points, triangles, origin, spacing, found):
    """Add the windings round the nodes of a grid to what is found, an array of its counts."""
    last_x, last_y, last_z = found.shape[0] - 1, found.shape[1] - 1, found.shape[2] - 1
    for t in range(triangles.shape[0]):
        first_column, end_column = _nodes_beside(points, triangles[t], 0, origin, spacing)
        first_row, end_row = _nodes_beside(points, triangles[t], 1, origin, spacing)
        for column in range(max(0, first_column), min(last_x + 1, end_column)):
            for row in range(max(0, first_row), min(last_y + 1, end_row)):
                x, y = origin[0] + spacing * column, origin[1] + spacing * row
                sign, height = _crossing(points, triangles[t], x, y)
                below = min(last_z, ceil((height - origin[2]) / spacing) - 1)
                if sign != 0 and below >= 0:
                    found[column, row, below] += sign
    for column in range(last_x + 1):
        for row in range(last_y + 1):
            for level in range(last_z - 1, -1, -1):
                found[column, row, level] += found[column, row, level + 1]


@njit(cache=True)
def _nodes_beside(points, corners, axis, origin, spacing):
    """First node of a grid along an axis that is near a triangle, and the one behind the last."""
    a = (points[corners[0], axis] - origin[axis]) / spacing
    b = (points[corners[1], axis] - origin[axis]) / spacing
    c = (points[corners[2], axis] - origin[axis]) / spacing
    return floor(min(a, b, c)), ceil(max(a, b, c)) + 1


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
