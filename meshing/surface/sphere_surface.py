"""Truncated sphere as the closed surface of a joint."""

import math

import numpy as np

from reflowshock.meshing.surface.closed_surface import ClosedSurface, close_surface
from reflowshock.meshing.surface.truncated_sphere import TruncatedSphere

AROUND, LEVELS = 96, 97  # vertices per circle, number of circles


def sphere_surface(sphere: TruncatedSphere, around: int = AROUND, levels: int = LEVELS) -> ClosedSurface:
    """Triangulate a truncated sphere in the joint's own frame; the section at each level has the area of its circle.

    Args:
        sphere: Zone of a sphere between two parallel discs: height and radii of the discs [m].
        around: Number of vertices per section.
        levels: Number of sections at equal distances in height.

    Returns:
        Vertices, triangles and their labels, closed by a disc on each pad.
    """
    heights = np.linspace(0.0, sphere.height, levels)
    angles = 2.0 * math.pi * np.arange(around) / around
    circumradius = math.sqrt(angles[1] / math.sin(angles[1]))  # of a polygon with the area of the unit circle
    radii = circumradius * np.sqrt(sphere.radius**2 - (heights - sphere.centre) ** 2)
    x, y = radii[:, None] * np.cos(angles), radii[:, None] * np.sin(angles)
    points = np.stack([x, y, np.broadcast_to(heights[:, None], x.shape)], axis=-1).reshape(-1, 3)
    ring = np.arange(around)
    first = (np.arange(levels - 1)[:, None] * around + ring).ravel()
    second = (np.arange(levels - 1)[:, None] * around + np.roll(ring, -1)).ravel()
    triangles = np.vstack(
        [np.column_stack([first, second, second + around]), np.column_stack([first, second + around, first + around])]
    )
    return close_surface(points, triangles, ring, (levels - 1) * around + ring)
