"""Distances of grid nodes to triangles within a narrow band about them; nodes outside the band are not visited."""

from math import ceil, floor, inf, sqrt

import numpy as np
from numba import njit

from reflowshock.particles.core.surface_measure import area_vector

# Least height of a triangle over its longest edge, the square root of rounding. A flatter triangle is represented by
# its edges with a smaller error; rounding leaves its normal no better.
LEAST_HEIGHT = 1e-8


@njit(cache=True)
def lower_to_distance(points, triangles, origin, spacing, distance):
    """Lower the distances at the nodes of a grid to the distances to triangles where these are smaller.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        origin: Position of the first node, shape (3,) [m].
        spacing: Distance between nodes, a scalar [m].
        distance: Distances at the nodes, shape (i, j, k) [m], lowered in place; the largest is the width of the band.
    """
    band = distance.max()
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t]
        for d in range(3):
            least, most = min(points[a, d], points[b, d], points[c, d]), max(points[a, d], points[b, d], points[c, d])
            low[d] = max(0, ceil((least - band - origin[d]) / spacing))
            high[d] = min(distance.shape[d] - 1, floor((most + band - origin[d]) / spacing)) + 1
        plane = _plane(points, (a, b, c))
        for i in range(low[0], high[0]):
            x = origin[0] + spacing * i
            for j in range(low[1], high[1]):
                y = origin[1] + spacing * j
                for k in range(low[2], high[2]):
                    node, limit2 = (x, y, origin[2] + spacing * k), distance[i, j, k] ** 2
                    nearest2 = _squared_distance(node, points, (a, b, c), plane, limit2)
                    if nearest2 < limit2:
                        distance[i, j, k] = sqrt(nearest2)


@njit(cache=True)
def _plane(points, corners):
    """Return the normal of a triangle, of twice its area [m^2], and its square [m^4]; zeros for a degenerate one."""
    a, b, c = corners
    nx, ny, nz = area_vector(points, a, b, c)
    size2, longest2 = nx * nx + ny * ny + nz * nz, 0.0
    for i, j in ((a, b), (b, c), (c, a)):
        ex, ey, ez = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        longest2 = max(longest2, ex * ex + ey * ey + ez * ez)
    if size2 <= (LEAST_HEIGHT * longest2) ** 2:
        return (0.0, 0.0, 0.0), 0.0
    return (nx, ny, nz), size2


@njit(cache=True)
def _squared_distance(node, points, corners, plane, limit2):
    """Return the squared distance of a node to a triangle [m^2]; infinity if the plane alone is beyond the limit.

    ``plane``: As ``_plane`` returns it.
    """
    (nx, ny, nz), size2 = plane
    a = corners[0]
    x, y, z = node[0] - points[a, 0], node[1] - points[a, 1], node[2] - points[a, 2]
    across = x * nx + y * ny + z * nz
    if across * across > limit2 * size2:
        return inf
    is_above, nearest2 = size2 > 0.0, inf
    for k in range(3):
        i, j = corners[k], corners[(k + 1) % 3]
        ex, ey, ez = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        x, y, z = node[0] - points[i, 0], node[1] - points[i, 1], node[2] - points[i, 2]
        is_above &= (ny * ez - nz * ey) * x + (nz * ex - nx * ez) * y + (nx * ey - ny * ex) * z >= 0.0
        length2 = ex * ex + ey * ey + ez * ez
        along = min(max((x * ex + y * ey + z * ez) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
        x, y, z = x - along * ex, y - along * ey, z - along * ez
        nearest2 = min(nearest2, x * x + y * y + z * z)
    return across * across / size2 if is_above else nearest2
