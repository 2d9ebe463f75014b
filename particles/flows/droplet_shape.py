"""Initial shape of a droplet: a cubic lattice of particles inside a triangulated sphere, cube or half sphere."""

from math import pi, sqrt

import numpy as np
from scipy.spatial import ConvexHull

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.grid import Grid
from reflowshock.particles.flows.droplet import Droplet
from reflowshock.particles.surface.cloud_level_set import boundary_loops
from reflowshock.particles.surface.level_set import LevelSet, extract_surface, smooth_on_level_set


def start_shape(scene: Droplet, edge: float) -> tuple[Floats, tuple[Floats, Indices], float]:
    """Create the particles and the surface of a droplet.

    Args:
        scene: Parameters of the droplet: liquid, size, wall, speed, effects and numerics.
        edge: Edge length of the triangles in spacings.

    Returns:
        Positions of the particles, shape (3, n) [m]; vertices, shape (m, 3) [m], and triangles of the surface; and the
        spacing at which the particles have the volume of the droplet [m].
    """
    radius, side = 0.5 * scene.diameter, scene.volume ** (1.0 / 3.0)
    across = int(np.ceil(2.0 * scene.diameter / scene.spacing)) + 1
    places = np.arange(-across, across) + 0.5
    if scene.start == "cube" and not scene.has_wall:
        count = round(side / scene.spacing)
        places = np.arange(count) + 0.5 - 0.5 * count
    lattice = scene.spacing * np.stack(np.meshgrid(places, places, places, indexing="ij")).reshape(3, -1)
    points, triangles = _sphere(radius, edge * scene.spacing)
    inside = np.ones(lattice.shape[1], dtype=bool)
    if scene.start == "cube" and not scene.has_wall:
        points, triangles = _cube(side, edge * scene.spacing)
    elif scene.impact_speed or not scene.has_wall:
        inside = (lattice**2).sum(axis=0) < radius**2
    else:
        inside = ((lattice**2).sum(axis=0) < 2.0 ** (2.0 / 3.0) * radius**2) & (lattice[2] > 0.0)
        points, triangles = _half(*_sphere(2.0 ** (1.0 / 3.0) * radius, edge * scene.spacing), edge * scene.spacing)
    spacing = float(np.cbrt(scene.volume / inside.sum()))
    liquid = lattice[:, inside] * (spacing / scene.spacing)
    if scene.impact_speed:
        lift = radius + 0.5 * edge * scene.spacing
        liquid[2] += lift
        points[:, 2] += lift
    return liquid, (points, triangles), spacing


def _sphere(radius: float, edge: float) -> tuple[Floats, Indices]:
    """Triangulate a sphere: the convex hull of points on a spiral, scaled to the exact volume."""
    count = int(4.0 * pi * radius**2 / (0.5 * sqrt(3.0) * edge**2))
    turn, height = pi * (1.0 + sqrt(5.0)) * (np.arange(count) + 0.5), 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    across = np.sqrt(1.0 - height**2)
    points = np.stack((across * np.cos(turn), across * np.sin(turn), height), axis=1)
    hull = ConvexHull(points)
    triangles = hull.simplices.astype(np.int32)
    corner = points[triangles]
    inward = np.einsum("td,td->t", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return points * radius * float(np.cbrt(4.0 * pi / 3.0 / hull.volume)), triangles


def _cube(width: float, edge: float) -> tuple[Floats, Indices]:
    """Triangulate a cube with rounded edges."""
    grid = Grid.around(width * np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]]), edge)
    x, y, z = np.meshgrid(*grid.axes(), indexing="ij")
    level = LevelSet(grid, np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z)) - 0.5 * width)
    return smooth_on_level_set(level, *extract_surface(level), ())


def _half(points: Floats, triangles: Indices, edge: float) -> tuple[Floats, Indices]:
    """Return the upper half of a triangulated sphere, with its boundary on the wall."""
    radius = float(np.linalg.norm(points, axis=1).mean())
    low = np.abs(points[:, 2]) < 0.4 * edge
    points[low, 2] = 0.0
    points[low] *= radius / np.linalg.norm(points[low], axis=1)[:, None]
    upper = triangles[(points[triangles, 2] >= 0.0).all(axis=1)]
    used, numbers = np.unique(upper, return_inverse=True)
    points, triangles = points[used], numbers.reshape(-1, 3).astype(np.int32)
    for ring in boundary_loops(triangles):  # some boundary vertices are still above the wall
        points[ring, 2] = 0.0
        points[ring] *= radius / np.linalg.norm(points[ring], axis=1)[:, None]
    return points, triangles
