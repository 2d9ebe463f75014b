"""A liquid's surface on a solid body: how much of it is wet, and its image behind the body, whose face is a mirror."""

import numpy as np
from numba import njit

from reflowshock.arrays import Floats
from reflowshock.particles.surface.level_set import LevelSet


def settle(ground: LevelSet, points: Floats, outward: Floats, near: float) -> tuple[Floats, Floats]:
    """Put vertices that have come down on the ground on it.

    Args:
        ground: distance to it [m].
        points: of the surface `(m, 3)` [m]; changed.
        outward: its normals `(m, 3)`.
        near: what is nearer and faces the ground is on it [m]; it is partly so up to twice that.

    Returns:
        How much of each vertex lies on the ground `(m,)`, 0 to 1, and the ground's normals there `(m, 3)`.
    """
    distance, normals = _distance_and_normals(ground, points)
    share = np.clip(2.0 - distance / near, 0.0, 1.0)
    away = (outward * normals).sum(axis=1) > 0.0
    down = (distance < near) & ~away | (distance < 0.0)
    points[down] -= distance[down, None] * normals[down]
    share[away] = 0.0
    return share, normals


def along(vectors: Floats, share: Floats, normals: Floats) -> Floats:
    """Return vectors `(m, 3)` of vertices without that share of their component along the normals of the ground."""
    return vectors - (share * (vectors * normals).sum(axis=1))[:, None] * normals


def reflected(ground: LevelSet, points: Floats, vectors: Floats, reach: float) -> tuple[Floats, Floats]:
    """Return the images of points `(m, 3)` [m] and of vectors there `(m, 3)` behind the face of the ground.

    Points farther than the reach [m] have none: they stay where they are, with vectors of zero.
    """
    distance, normals = _distance_and_normals(ground, points)
    near = (distance < reach)[:, None]
    turned = vectors - 2.0 * (vectors * normals).sum(axis=1)[:, None] * normals
    return points - np.where(near, 2.0 * distance[:, None] * normals, 0.0), np.where(near, turned, 0.0)


def _distance_and_normals(ground: LevelSet, points: Floats) -> tuple[Floats, Floats]:
    """Distance to the ground [m] and its normals at points `(m, 3)`: `LevelSet.at` of order 1, in one loop."""
    distance, normals = np.empty(len(points)), np.empty_like(points)
    _interpolate(ground.values, ground.grid.indices(points), distance, normals)
    return distance, normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]


@njit(cache=True)
def _interpolate(values, places, distance, gradient):
    """Values and central differences over a node spacing at places in node spacings, linear between nodes."""
    for v in range(places.shape[0]):
        x, y, z = places[v]
        distance[v] = _between(values, x, y, z)
        gradient[v, 0] = _between(values, x + 0.5, y, z) - _between(values, x - 0.5, y, z)
        gradient[v, 1] = _between(values, x, y + 0.5, z) - _between(values, x, y - 0.5, z)
        gradient[v, 2] = _between(values, x, y, z + 0.5) - _between(values, x, y, z - 0.5)


@njit(cache=True)
def _between(values, x, y, z):
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
