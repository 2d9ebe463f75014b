"""Area and volume of a triangulated free surface that ends on flat walls, and their gradients.

The liquid body is closed by the polygons of its contact lines; all walls are planes z = constant.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import sparse

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]


@njit(cache=True)
def surface_area(points, triangles):
    """Area of the triangles [m^2]; `points (n, 3)`, `triangles (t, 3)`."""
    total = 0.0
    for t in range(triangles.shape[0]):
        a, b, c = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
        total += np.sqrt((np.cross(b - a, c - a) ** 2).sum())
    return 0.5 * total


@njit(cache=True)
def _volume_and_gradient(points, triangles, gradient):
    """Sum of the tetrahedra (origin, triangle); adds its gradient."""
    total = 0.0
    for t in range(triangles.shape[0]):
        for k in range(3):
            i, j, m = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            cx = points[j, 1] * points[m, 2] - points[j, 2] * points[m, 1]
            cy = points[j, 2] * points[m, 0] - points[j, 0] * points[m, 2]
            cz = points[j, 0] * points[m, 1] - points[j, 1] * points[m, 0]
            gradient[i, 0] += cx / 6.0
            gradient[i, 1] += cy / 6.0
            gradient[i, 2] += cz / 6.0
            if k == 0:
                total += (points[i, 0] * cx + points[i, 1] * cy + points[i, 2] * cz) / 6.0
    return total


def ring_area(points: Floats, ring: Indices) -> float:
    """Area of the polygon of a contact line [m^2] (shoelace), positive if counter-clockwise seen from +z."""
    x, y = points[ring, 0], points[ring, 1]
    return 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def ring_area_gradient(points: Floats, ring: Indices) -> Floats:
    """Gradient of `ring_area` with respect to the vertices of the ring, `(k, 3)` [m]."""
    x, y = points[ring, 0], points[ring, 1]
    dx = 0.5 * (np.roll(y, -1) - np.roll(y, 1))
    dy = 0.5 * (np.roll(x, 1) - np.roll(x, -1))
    return np.column_stack((dx, dy, np.zeros(len(ring))))


def wall_side(wall: int) -> float:
    """Return z of the outward normal of the liquid on a wall: -1 on the board (wall 0), +1 on the package."""
    return -1.0 if wall == 0 else 1.0


def volume_and_gradient(
    points: Floats, triangles: Indices, rings: Sequence[Indices], heights: Sequence[float]
) -> tuple[float, Floats]:
    """Volume enclosed by the surface and the walls [m^3], and its gradient at fixed walls `(n, 3)` [m^2].

    Divergence theorem: 3 V = integral of x . n over the free surface and over the walled polygons.
    """
    gradient = np.zeros_like(points)
    volume = _volume_and_gradient(points, triangles, gradient)
    for wall, (ring, height) in enumerate(zip(rings, heights, strict=True)):
        third = wall_side(wall) * height / 3.0
        volume += third * ring_area(points, ring)
        gradient[ring] += third * ring_area_gradient(points, ring)
    return volume, gradient


def enclosed_volume(points: Floats, triangles: Indices, rings: Sequence[Indices], heights: Sequence[float]) -> float:
    """Volume enclosed by the surface and the walls [m^3]."""
    return volume_and_gradient(points, triangles, rings, heights)[0]


@njit(cache=True)
def _cotangents(points, triangles):
    """Cotangent of the angle at each corner of each triangle, `(t, 3)`."""
    result = np.empty(triangles.shape)
    for t in range(triangles.shape[0]):
        for k in range(3):
            apex = points[triangles[t, k]]
            u = points[triangles[t, (k + 1) % 3]] - apex
            v = points[triangles[t, (k + 2) % 3]] - apex
            result[t, k] = (u * v).sum() / np.sqrt((np.cross(u, v) ** 2).sum())
    return result


def cotangent_laplacian(points: Floats, triangles: Indices, size: int) -> sparse.csr_matrix:
    """Stiffness K of the surface Laplacian, `(size, size)`, no unit.

    Symmetric, positive semidefinite; K x is exactly the gradient of the area of the triangulation
    (Pinkall & Polthier 1993).
    """
    half = 0.5 * _cotangents(points, triangles)
    i, j = np.roll(triangles, -1, axis=1).ravel(), np.roll(triangles, -2, axis=1).ravel()
    weight = half.ravel()
    rows = np.concatenate((i, j, i, j))
    columns = np.concatenate((j, i, i, j))
    values = np.concatenate((-weight, -weight, weight, weight))
    return sparse.csr_matrix((values, (rows, columns)), shape=(size, size))
