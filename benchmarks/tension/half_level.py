"""Shape of a particle cloud without a tracked surface: the level c = 1/2 of a smoothed colour function along rays.

The same measure serves all models. The level deviates from the surface by an amount that grows with the curvature; a
shape is therefore compared with the same level of the exact body, filled with a much finer lattice.
"""

from math import pi, sqrt

import numpy as np
from numba import njit, prange

from benchmarks.tension.free_pressure import WENDLAND_C4
from reflowshock.arrays import Floats

RAYS = 400
# Kernel support and ray steps over the spacing; number of bisections.
SUPPORT, STEP, HALVINGS = 4.0, 0.5, 30
# Spacing of the lattice in an exact body over the particle spacing.
FINE = 1.0 / 3.0


def ray_directions(half: bool) -> Floats:
    """Return unit vectors, shape (400, 3), uniform over the sphere or its upper half (``half``), the first upwards."""
    height = 1.0 - (np.arange(RAYS) / RAYS if half else 2.0 * np.arange(RAYS) / (RAYS - 1.0))
    turn, across = pi * (1.0 + sqrt(5.0)) * np.arange(RAYS), np.sqrt(np.maximum(1.0 - height**2, 0.0))
    return np.stack((across * np.cos(turn), across * np.sin(turn), height), axis=1)


def level_points(points: Floats, volume: Floats, spacing: float, half: bool) -> Floats:
    """Return points of the level 1/2 of the colour along rays from the particles' centre, shape (400, 3) [m].

    Args:
        points: Particle positions [m], shape (n, 3).
        volume: Particle volumes [m^3], shape (n,).
        spacing: Spacing [m] of the tested particles, also for the lattice of an exact body.
        half: Whether the particles stand on the mirror z = 0; rays then start at the foot of the centre.
    """
    centre = volume @ points / volume.sum()
    if half:
        centre[2] = 0.0
    distances, directions = np.empty(RAYS), ray_directions(half)
    _cross(points, volume, (centre, SUPPORT * spacing, STEP * spacing, half), directions, distances)
    return centre + distances[:, None] * directions


def fill_lattice(inside, reach: float, spacing: float) -> tuple[Floats, Floats]:
    """Fill a body with a fine lattice.

    Args:
        inside: Function of points, shape (k, 3) [m], that returns whether each is in the body.
        reach: Largest distance of the body from the origin [m].
        spacing: Spacing of the tested particles; the lattice is finer [m].

    Returns:
        Points in the body, shape (n, 3) [m], and their volumes, shape (n,) [m^3].
    """
    fine = FINE * spacing
    places = fine * (np.arange(-int(reach / fine) - 1, int(reach / fine) + 1) + 0.5)
    points = np.stack(np.meshgrid(places, places, places, indexing="ij")).reshape(3, -1).T
    points = points[inside(points)]
    return points, np.full(len(points), fine**3)


@njit(cache=True)
def _colour_at(point, points, volume, support, half):
    """Return the colour at a point, mirror images included."""
    total = 0.0
    for j in range(points.shape[0]):
        dx, dy, dz = point[0] - points[j, 0], point[1] - points[j, 1], point[2] - points[j, 2]
        across2 = dx * dx + dy * dy
        if across2 >= support * support:
            continue
        for image in range(1 + half):
            height = dz if image == 0 else point[2] + points[j, 2]
            q = sqrt(across2 + height * height) / support
            if q < 1.0:
                total += volume[j] * (1.0 - q) ** 6 * (1.0 + 6.0 * q + 35.0 / 3.0 * q * q)
    return WENDLAND_C4 * total / support**3


@njit(cache=True, parallel=True)
def _cross(points, volume, how, directions, distances):
    """Compute the distances from the centre at which rays leave the first liquid that they cross."""
    centre, support, step, half = how
    for r in prange(directions.shape[0]):
        low, high = 0.0, step
        while _colour_at(centre + high * directions[r], points, volume, support, half) > 0.5:
            low, high = high, high + step
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if _colour_at(centre + middle * directions[r], points, volume, support, half) > 0.5:
                low = middle
            else:
                high = middle
        distances[r] = 0.5 * (low + high)
