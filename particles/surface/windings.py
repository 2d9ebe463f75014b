"""How often a closed surface winds round points: the signs of its crossings above them, summed.

The winding number does not ask which triangle is nearest. So it holds where a surface is folded, or sheets of it have
crossed, as they do for some steps where a narrow groove closes; there the nearest sheet may face the wrong way.
"""

from math import ceil, floor

from numba import njit


@njit(cache=True)
def _is_left(points, start, end, x, y):
    """Whether x, y is left of an edge seen from above; both triangles at the edge get the same answer."""
    a, b = points[min(start, end)], points[max(start, end)]
    return ((b[0] - a[0]) * (y - a[1]) >= (b[1] - a[1]) * (x - a[0])) == (start < end)


@njit(cache=True)
def _crossing(points, corners, x, y):
    """Whether the vertical through x, y leaves a body through a triangle (1), enters (-1) or misses it (0); where."""
    i, j, k = corners
    left = _is_left(points, i, j, x, y)
    if _is_left(points, j, k, x, y) != left or _is_left(points, k, i, x, y) != left:
        return 0, 0.0
    a, b, c = points[i], points[j], points[k]
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if area == 0.0:
        return 1 if left else -1, (a[2] + b[2] + c[2]) / 3.0
    second = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
    third = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
    return 1 if left else -1, a[2] + second * (b[2] - a[2]) + third * (c[2] - a[2])


@njit(cache=True)
def about(places, points, triangles, found):
    """Add the windings round places `(n, 3)` to what is found `(n,)`."""
    for n in range(places.shape[0]):
        for t in range(triangles.shape[0]):
            sign, height = _crossing(points, triangles[t], places[n, 0], places[n, 1])
            if height > places[n, 2]:
                found[n] += sign


@njit(cache=True)
def on_grid(points, triangles, origin, spacing, found):
    """Add the windings round the nodes of a grid to what is found, an array of its counts."""
    last_x, last_y, last_z = found.shape[0] - 1, found.shape[1] - 1, found.shape[2] - 1
    for t in range(triangles.shape[0]):
        corner = (points[triangles[t]] - origin) / spacing
        for column in range(max(0, floor(corner[:, 0].min())), min(last_x, ceil(corner[:, 0].max())) + 1):
            for row in range(max(0, floor(corner[:, 1].min())), min(last_y, ceil(corner[:, 1].max())) + 1):
                x, y = origin[0] + spacing * column, origin[1] + spacing * row
                sign, height = _crossing(points, triangles[t], x, y)
                below = min(last_z, ceil((height - origin[2]) / spacing) - 1)
                if sign != 0 and below >= 0:
                    found[column, row, below] += sign
    for level in range(last_z - 1, -1, -1):
        found[:, :, level] += found[:, :, level + 1]
