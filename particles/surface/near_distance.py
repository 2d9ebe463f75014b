"""Distance of the nodes of a grid to triangles, as far as a band about them: the nodes beyond it are not visited."""

from math import ceil, floor, inf, sqrt

import numpy as np
from numba import njit

from reflowshock.particles.core.surface_measure import area_vector

# Of a triangle, over its longest edge: what is less high than the root of rounding is its edges, by less than that. Of
# the normals of such ones rounding leaves no more than that; of worse ones nothing.
LEAST_HEIGHT = 1e-8


@njit(cache=True)
def narrow(points, triangles, origin, spacing, found):
    """Lower the distances found `(i, j, k)` [m] at the nodes of a grid to those to triangles, where these are less.

    Args:
        points: `(n, 3)` [m].
        triangles: `(t, 3)`.
        origin: of the first node `(3,)` [m].
        spacing: of the nodes [m].
        found: the band, at first, in which they are told; its shape is that of the grid.
    """
    band = found.max()
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t]
        for d in range(3):
            least, most = min(points[a, d], points[b, d], points[c, d]), max(points[a, d], points[b, d], points[c, d])
            low[d] = max(0, ceil((least - band - origin[d]) / spacing))
            high[d] = min(found.shape[d] - 1, floor((most + band - origin[d]) / spacing)) + 1
        plane = _plane(points, (a, b, c))
        for i in range(low[0], high[0]):
            x = origin[0] + spacing * i
            for j in range(low[1], high[1]):
                y = origin[1] + spacing * j
                for k in range(low[2], high[2]):
                    place, known2 = (x, y, origin[2] + spacing * k), found[i, j, k] ** 2
                    nearest2 = _square_of_distance(place, points, (a, b, c), plane, known2)
                    if nearest2 < known2:
                        found[i, j, k] = sqrt(nearest2)


@njit(cache=True)
def _plane(points, corners):
    """Normal of a triangle, twice its area long [m^2], and the square of that length [m^4]; zeros for mere edges."""
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
def _square_of_distance(place, points, corners, plane, known2):
    """Square of the distance of a place to a triangle; where its plane alone is farther than is known, infinity.

    ``plane``: as `_plane` returns it.
    """
    (nx, ny, nz), size2 = plane
    a = corners[0]
    x, y, z = place[0] - points[a, 0], place[1] - points[a, 1], place[2] - points[a, 2]
    across = x * nx + y * ny + z * nz
    if across * across > known2 * size2:
        return inf
    is_above, nearest2 = size2 > 0.0, inf
    for k in range(3):
        i, j = corners[k], corners[(k + 1) % 3]
        ex, ey, ez = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        x, y, z = place[0] - points[i, 0], place[1] - points[i, 1], place[2] - points[i, 2]
        is_above &= (ny * ez - nz * ey) * x + (nz * ex - nx * ez) * y + (nx * ey - ny * ex) * z >= 0.0
        length2 = ex * ex + ey * ey + ez * ez
        along = min(max((x * ex + y * ey + z * ez) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
        x, y, z = x - along * ex, y - along * ey, z - along * ez
        nearest2 = min(nearest2, x * x + y * y + z * z)
    return across * across / size2 if is_above else nearest2
