"""Exact level sets of drops."""

import numpy as np

from reflowshock.particles.core.grid import Grid
from reflowshock.particles.surface.level_set import LevelSet


def ball(grid, centre, radius, mirrored=False):
    """Return the level set of a ball; ``mirrored``: of its part above z = 0 and the mirror image of that part."""
    nodes = np.stack(np.meshgrid(*grid.axes(), indexing="ij"), axis=-1)
    if mirrored:
        nodes[..., 2] = np.abs(nodes[..., 2])
    return LevelSet(grid, np.linalg.norm(nodes - np.asarray(centre), axis=-1) - radius)


def grid_around_ball(centre, radius, spacing):
    corners = np.asarray(centre) + radius * np.array([[-1.0], [1.0]])
    return Grid.around(corners, spacing)


def cap_radius(volume, angle):
    """Return the sphere radius [m] of a cap of a volume and contact angle."""
    c = np.cos(angle)
    return np.cbrt(3.0 * volume / (np.pi * (1.0 - c) ** 2 * (2.0 + c)))
