"""Exact level sets of drops."""

import numpy as np

from reflowshock.particles.core.grid import Grid
from reflowshock.particles.surface.level_set import LevelSet


def ball(grid, centre, radius, mirrored=False):
    """Return the exact level set of a ball: signed distances at the nodes of a grid [m], negative inside.

    Args:
        grid: Grid of nodes.
        centre: Centre, shape (3,) [m].
        radius: Radius [m].
        mirrored: Whether the body is the part above z = 0 and its mirror image.
    """
    nodes = np.stack(np.meshgrid(*grid.axes(), indexing="ij"), axis=-1)
    if mirrored:
        nodes[..., 2] = np.abs(nodes[..., 2])
    return LevelSet(grid, np.linalg.norm(nodes - np.asarray(centre), axis=-1) - radius)


def grid_around_ball(centre, radius, spacing):
    """Return a grid of nodes that encloses a ball.

    Args:
        centre: Centre, shape (3,) [m].
        radius: Radius [m].
        spacing: Distance between nodes [m].
    """
    corners = np.asarray(centre) + radius * np.array([[-1.0], [1.0]])
    return Grid.around(corners, spacing)


def cap_radius(volume, angle):
    """Return the radius of the sphere of a cap [m], from its volume [m^3] and contact angle [rad]."""
    c = np.cos(angle)
    return np.cbrt(3.0 * volume / (np.pi * (1.0 - c) ** 2 * (2.0 + c)))
