"""A liquid's surface on a solid body: how much of it is wet, and its image behind the body, whose face is a mirror."""

import numpy as np

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
    distance = ground.at(points, 1)
    share = np.clip(2.0 - distance / near, 0.0, 1.0)
    normals, close = np.zeros_like(points), share > 0.0
    normals[close] = _normals(ground, points[close])
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
    images, turned, distance = points.copy(), np.zeros_like(vectors), ground.at(points, 1)
    near = distance < reach
    normals = _normals(ground, points[near])
    images[near] -= 2.0 * distance[near, None] * normals
    turned[near] = vectors[near] - 2.0 * (vectors[near] * normals).sum(axis=1)[:, None] * normals
    return images, turned


def _normals(ground: LevelSet, points: Floats) -> Floats:
    gradient = ground.gradient(points, 1)
    return gradient / np.maximum(np.linalg.norm(gradient, axis=1), 1e-300)[:, None]
