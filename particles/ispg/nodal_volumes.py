"""Volumes of particles, the weights of direct nodal integration: exact for quadratic polynomials over the liquid.

A particle has the cell that the density of particles around it leaves, half of one on the free surface or a wall. These
volumes, which know the shape of the liquid only roughly, become v exp(q), q a quadratic polynomial, so that sums over
the particles of 1, x and x x equal the integrals over the body that the tracked surface encloses: of all positive
volumes with this property they are the closest to the first ones (least relative entropy).
"""

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.surface_measure import ring_area, wall_corners
from reflowshock.particles.core.symmetry import share

PAIRS = np.triu_indices(3)
NEWTON_STEPS = 30
TOLERANCE = 1e-12


class NoVolumes(RuntimeError):
    """No positive volumes of the particles have the moments of the body."""


def body_moments(body: Body) -> tuple[float, Floats, Floats]:
    """Integrals of 1 [m^3], x `(3,)` [m^4] and x x `(3, 3)` [m^5] over the liquid, by tetrahedra with the origin."""
    walls = zip(body.cloud.rings, body.plates, strict=True)
    faces = [body.points[body.triangles], *(wall_corners(body.points, ring, plate) for ring, plate in walls)]
    corners = np.concatenate(faces)
    volumes = np.einsum("td,td->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    total = corners.sum(axis=1)
    second = (total * volumes[:, None]).T @ total
    flat = corners.reshape(-1, 3)
    second += (flat * np.repeat(volumes, 3)[:, None]).T @ flat
    return float(volumes.sum()), volumes @ total / 4.0, second / 20.0


def cell_share(body: Body) -> Floats:
    """Part of a whole cell that each particle has, were walls not there, `(n,)`."""
    on_surface = np.arange(len(body.points)) < body.cloud.surface_count
    return np.where(on_surface, 0.5, 1.0)


def wall_shares(body: Body, volumes: Floats) -> Floats:
    """Wetted area that each particle on a wall stands for `(n,)` [m^2]: shared out by their volumes `(n,)` [m^3]."""
    areas = np.zeros(len(body.points))
    for wall, ring in enumerate(body.cloud.rings):
        on_wall = body.cloud.wall == wall
        wetted = ring_area(body.points, ring)
        areas[on_wall] = wetted * volumes[on_wall] / volumes[on_wall].sum()
    return areas


def nodal_volumes(body: Body, density: Floats) -> Floats:
    """Volumes of the particles `(n,)` [m^3].

    Args:
        body: the liquid body.
        density: `(n,)` of particles around each, walls mirrored, the free surface counted by `cell_share`.


    Raises:
        NoVolumes: there are none.
    """
    volume, first, second = body_moments(body)
    # Around a particle of the free surface only half of its surroundings are liquid.
    cells = cell_share(body) ** 2 / density * np.where(body.cloud.wall >= 0, 0.5, 1.0) * share(body.cloud)
    found = cells * (volume / cells.sum())
    centre, length = first / volume, np.cbrt(volume)
    offset = (body.points - centre) / length
    powers = np.column_stack((np.ones(len(offset)), offset, offset[:, PAIRS[0]] * offset[:, PAIRS[1]]))
    central = (second - np.outer(first, first) / volume) / length**2
    wanted = np.concatenate(([volume], np.zeros(3), central[PAIRS]))
    for _ in range(NEWTON_STEPS):
        missing = wanted - powers.T @ found
        if np.abs(missing).max() < TOLERANCE * volume:
            return found
        exponent = powers @ np.linalg.solve((powers * found[:, None]).T @ powers, missing)
        found = found * np.exp(exponent / max(1.0, np.abs(exponent).max()))
    raise NoVolumes("the particles fill the liquid too unevenly: no volumes of theirs have its moments of inertia")
