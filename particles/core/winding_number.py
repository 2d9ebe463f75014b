"""Which points lie inside a closed triangulated surface: the winding number, from solid angles."""

import numpy as np
from numba import njit, prange


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
