"""Shifting of the particles below the surface, for even spacing and a distance from the surface."""

import numpy as np
from numba import njit, prange

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.neighbours import NeighbourList
from reflowshock.particles.core.plate import slide
from reflowshock.particles.core.symmetry import fold, on_plane, unit

REPULSION_RANGE = 1.1
REPULSION_STRENGTH = 0.15
LARGEST_SHIFT = 0.1
SMALLEST_DEPTH = 0.4
SMALLEST_HEIGHT = 0.25


@njit(cache=True, parallel=True)
def _repulsion(rows, points, lists, reach):
    """Return the sum of unit vectors away from the neighbours, weighted by 1 - r/reach, shape (m, 3)."""
    offsets, indices = lists
    result = np.zeros((rows.shape[0], 3))
    for r in prange(rows.shape[0]):
        i = rows[r]
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
            square = x * x + y * y + z * z
            if square < reach * reach:
                distance = np.sqrt(square)
                push = (1.0 - distance / reach) / distance
                result[r, 0] += push * x
                result[r, 1] += push * y
                result[r, 2] += push * z
    return result


@njit(cache=True)
def _nearest(i, points, lists, count):
    """Return the closest neighbour of particle i among the first ``count`` particles, -1 without one."""
    offsets, indices = lists
    nearest, smallest = -1, np.inf
    for k in range(offsets[i], offsets[i + 1]):
        j = indices[k]
        if j < count:
            square = 0.0
            for d in range(3):
                square += (points[i, d] - points[j, d]) ** 2
            if square < smallest:
                nearest, smallest = j, square
    return nearest


@njit(cache=True, parallel=True)
def _penetration(rows, points, lists, normals, depth):
    """Return displacements to a depth below the tangent plane of the nearest surface vertex, shape (m, 3)."""
    result = np.zeros((rows.shape[0], 3))
    for r in prange(rows.shape[0]):
        j = _nearest(rows[r], points, lists, normals.shape[0])
        if j >= 0:
            below = 0.0
            for d in range(3):
                below += (points[j, d] - points[rows[r], d]) * normals[j, d]
            for d in range(3):
                result[r, d] = -max(depth - below, 0.0) * normals[j, d]
    return result


def interior_shift(body: Body, neighbours: NeighbourList, normals: Floats) -> Floats:
    """Return displacements that keep the m particles below the surface evenly spaced, shape (m, 3) [m].

    Particles repel each other; those on a wall stay on it, others keep away from surface, walls and planes of symmetry.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        neighbours: Neighbour list for the present positions, with a radius of at least 1.1 spacings.
        normals: Outward unit normals at the vertices of the surface, shape (s, 3).
    """
    cloud, rows = body.cloud, body.interior
    lists = (neighbours.offsets, neighbours.indices)
    shift = _repulsion(rows, body.points, lists, REPULSION_RANGE * cloud.spacing) * (REPULSION_STRENGTH * cloud.spacing)
    length = np.linalg.norm(shift, axis=1)
    shift *= np.minimum(1.0, LARGEST_SHIFT * cloud.spacing / np.maximum(length, 1e-300))[:, None]
    shift += _penetration(rows, body.points, lists, unit(fold(cloud, normals)), SMALLEST_DEPTH * cloud.spacing)
    shift = fold(cloud, slide(body.plates, cloud.wall[rows], shift), cloud.surface_count)
    shift += _away_from_plates(body, body.points[rows] + shift)
    return shift + _away_from_symmetry(body, body.points[rows] + shift)


def _away_from_plates(body: Body, points: Floats) -> Floats:
    """Return displacements that keep interior particles, now at ``points``, off the plates, shape (m, 3) [m].

    Where a drop spreads, the particles on its wall thin out and no longer prevent others from passing through.
    """
    result = np.zeros_like(points)
    loose = body.cloud.wall[body.interior] < 0
    for plate in body.plates:
        inward = -plate.side
        height = inward * plate.local(points)[:, 2]
        lift = np.where(loose, np.maximum(SMALLEST_HEIGHT * body.cloud.spacing - height, 0.0), 0.0)
        result += inward * lift[:, None] * plate.normal
    return result


def _away_from_symmetry(body: Body, points: Floats) -> Floats:
    """Return displacements that keep particles off the planes of symmetry, shape (m, 3) [m]."""
    result = np.zeros_like(points)
    for axis in body.cloud.symmetry:
        loose = ~on_plane(body.cloud, axis)[body.interior]
        lift = np.maximum(SMALLEST_HEIGHT * body.cloud.spacing - points[:, axis], 0.0)
        result[:, axis] = np.where(loose, lift, 0.0)
    return result
