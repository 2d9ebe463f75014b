"""Solid ground below a liquid's surface: contact with it, and mirror images behind its face.

The ground is a level set, the distance to solid bodies; vertices of the liquid's surface come to lie on its zero level.
"""

import numpy as np
from numba import njit

from reflowshock.arrays import Floats
from reflowshock.particles.surface.level_set import LevelSet


def settle_on_ground(ground: LevelSet, points: Floats, outward: Floats, near: float) -> tuple[Floats, Floats]:
    """Move vertices that have reached the ground onto it.

    Args:
        ground: Level set of the solid ground: distances at the nodes of a grid [m], negative inside it.
        points: Vertices of the surface, shape (m, 3) [m]; changed in place.
        outward: Outward unit normals of the vertices, shape (m, 3); a vertex faces the ground if they point into it.
        near: Distance below which a vertex that faces the ground lies on it [m]; between it and twice it partly so.

    Returns:
        Wetness of each vertex, shape (m,), 0 to 1, and the unit normals of the ground there, shape (m, 3).
    """
    distance, normals = _distance_and_normals(ground, points)
    wetness = np.clip(2.0 - distance / near, 0.0, 1.0)
    faces_away = (outward * normals).sum(axis=1) > 0.0
    is_down = (distance < near) & ~faces_away | (distance < 0.0)
    points[is_down] -= distance[is_down, None] * normals[is_down]
    wetness[faces_away] = 0.0
    return wetness, normals


def remove_normal_part(vectors: Floats, wetness: Floats, normals: Floats) -> Floats:
    """Return vectors without their component normal to the ground, in proportion to the wetness, shape (m, 3).

    Args:
        vectors: Vectors of any unit at the vertices of a surface, shape (m, 3); not changed.
        wetness: Share of the component that is removed, 0 to 1, shape (m,).
        normals: Unit normals of the ground, shape (m, 3).
    """
    return vectors - (wetness * (vectors * normals).sum(axis=1))[:, None] * normals


def reflect_at_ground(ground: LevelSet, points: Floats, vectors: Floats, reach: float) -> tuple[Floats, Floats]:
    """Return the mirror images of points and of vectors at them behind the face of the ground.

    Args:
        ground: Level set of the solid ground: distances at the nodes of a grid [m], negative inside it.
        points: Points, shape (m, 3) [m].
        vectors: Vectors at the points, shape (m, 3).
        reach: Distance beyond which a point has no image [m]; it is returned as it is, with a vector of zero.
    """
    distance, normals = _distance_and_normals(ground, points)
    is_near = (distance < reach)[:, None]
    reflected = vectors - 2.0 * (vectors * normals).sum(axis=1)[:, None] * normals
    return points - np.where(is_near, 2.0 * distance[:, None] * normals, 0.0), np.where(is_near, reflected, 0.0)


def _distance_and_normals(ground: LevelSet, points: Floats) -> tuple[Floats, Floats]:
    """Return distances to the ground [m] and its unit normals at points (m, 3), by trilinear interpolation."""
    distance, normals = np.empty(len(points)), np.empty_like(points)
    _interpolate(ground.values, ground.grid.indices(points), distance, normals)
    return distance, normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]


@njit(cache=True)
def _interpolate(values, indices, distance, gradient):
    """Write values and central differences over a node spacing at fractional node indices (m, 3)."""
    for v in range(indices.shape[0]):
        x, y, z = indices[v]
        distance[v] = _trilinear(values, x, y, z)
        gradient[v, 0] = _trilinear(values, x + 0.5, y, z) - _trilinear(values, x - 0.5, y, z)
        gradient[v, 1] = _trilinear(values, x, y + 0.5, z) - _trilinear(values, x, y - 0.5, z)
        gradient[v, 2] = _trilinear(values, x, y, z + 0.5) - _trilinear(values, x, y, z - 0.5)


@njit(cache=True)
def _trilinear(values, x, y, z):
    """Return the trilinear interpolation of nodal values at fractional node indices."""
    x = min(max(x, 0.0), values.shape[0] - 1.000001)
    y = min(max(y, 0.0), values.shape[1] - 1.000001)
    z = min(max(z, 0.0), values.shape[2] - 1.000001)
    i, j, k = int(x), int(y), int(z)
    x, y, z = x - i, y - j, z - k
    near = (values[i, j, k] * (1.0 - z) + values[i, j, k + 1] * z) * (1.0 - y)
    near += (values[i, j + 1, k] * (1.0 - z) + values[i, j + 1, k + 1] * z) * y
    far = (values[i + 1, j, k] * (1.0 - z) + values[i + 1, j, k + 1] * z) * (1.0 - y)
    far += (values[i + 1, j + 1, k] * (1.0 - z) + values[i + 1, j + 1, k + 1] * z) * y
    return near * (1.0 - x) + far * x
