"""Loops between the vertices of a liquid's surface and the particles beside them.

A vertex moves with the mean velocity of the particles within the support, weighted by their kernel; its force is
shared among the same particles by the same weights. So the work of the forces is that of the particles, and momentum
is kept. Above a wall in z = 0 the images of particles count too: they move and are pushed as in a mirror.
"""

from math import inf, sqrt

import numpy as np
from numba import njit, prange

from reflowshock.particles.sph.smoothing import shape


@njit(cache=True, parallel=True, error_model="numpy")
def find_weights(points, lists, fields, law, weights):
    """Find the kernel W between each vertex and the particles beside it.

    Args:
        points: of the vertices `(m, 3)` [m].
        lists: offsets and indices of the particles beside each.
        fields: `Fields`.
        law: `Law`.
        weights: `(2, 2, pairs)`, written: second W [1/m^3], for components along a wall and for those across it, in
            which images are reversed; first these over the sum of those along the wall at a vertex. Where there is no
            particle within the support, the nearest one has all.

    Returns:
        That sum at each vertex `(m,)` [1/m^3].
    """
    offsets, indices = lists
    inverse, levels = 1.0 / law.length, np.empty(points.shape[0])
    for v in prange(points.shape[0]):
        level, nearest, least = 0.0, -1, inf
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            dx, dy, dz = points[v, 0] - fields.x[j], points[v, 1] - fields.y[j], points[v, 2] - fields.z[j]
            distance = sqrt(dx * dx + dy * dy + dz * dz)
            if distance < least:
                nearest, least = k, distance
            own, image = shape(law.kernel, False, distance * inverse), 0.0
            if law.mirror:
                dz = points[v, 2] + fields.z[j]
                image = shape(law.kernel, False, sqrt(dx * dx + dy * dy + dz * dz) * inverse)
            weights[1, 0, k], weights[1, 1, k] = law.norm * (own + image), law.norm * (own - image)
            level += weights[1, 0, k]
        levels[v] = level
        for k in range(offsets[v], offsets[v + 1]):
            if level > 0.0:
                weights[0, 0, k], weights[0, 1, k] = weights[1, 0, k] / level, weights[1, 1, k] / level
            else:
                weights[0, 0, k] = weights[0, 1, k] = 1.0 if k == nearest else 0.0
    return levels


@njit(cache=True, parallel=True)
def carry(lists, shares, velocity, time_step, points):
    """Move vertices ``points`` `(m, 3)` over a time step with the velocities `(3, n)` of the particles."""
    offsets, indices = lists
    for v in prange(points.shape[0]):
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            points[v, 0] += time_step * shares[0, k] * velocity[0, j]
            points[v, 1] += time_step * shares[0, k] * velocity[1, j]
            points[v, 2] += time_step * shares[1, k] * velocity[2, j]


def velocities(lists, shares, fields):
    """Return the velocities `(m, 3)` [m/s] with which `carry` would move the vertices."""
    found = np.zeros((len(lists[0]) - 1, 3))
    carry(lists, shares, np.array((fields.u, fields.v, fields.w)), 1.0, found)
    return found


@njit(cache=True, parallel=True)
def share_out(lists, weights, vectors, found):
    """Add what each particle has of kinds of vectors of vertices `(k, m, 3)` to ``found`` `(k, 3, n)`.

    ``weights`` `(k, 2, pairs)`. Kinds are shared out side by side, so that every sum has one order.
    """
    offsets, indices = lists
    for kind in prange(vectors.shape[0]):
        given, own, result = weights[kind], vectors[kind], found[kind]
        for v in range(own.shape[0]):
            for k in range(offsets[v], offsets[v + 1]):
                j = indices[k]
                result[0, j] += given[0, k] * own[v, 0]
                result[1, j] += given[0, k] * own[v, 1]
                result[2, j] += given[1, k] * own[v, 2]


@njit(cache=True, parallel=True)
def find_strays(vertices, lists, fields, cover, strays):
    """Write how far vertices are to move along their normals [m] to lie just beyond the particles beside them `(m,)`.

    Args:
        vertices: points `(m, 3)` [m] and outward normals `(m, 3)`.
        lists: particles beside each vertex.
        fields: of the particles.
        cover: how far beyond each particle the surface is at least and at most [m]; its curvature about one, halved
            [1/m]; how far before a vertex a particle is left out [m].
        strays: found.
    """
    (points, normals), (offsets, indices), (least, most, bend, before) = vertices, lists, cover
    for v in prange(points.shape[0]):
        top = -inf
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            dx, dy, dz = fields.x[j] - points[v, 0], fields.y[j] - points[v, 1], fields.z[j] - points[v, 2]
            along = dx * normals[v, 0] + dy * normals[v, 1] + dz * normals[v, 2]
            aside2 = dx * dx + dy * dy + dz * dz - along * along
            if along < before:
                top = max(top, along - bend * aside2)
        strays[v] = max(top + least, min(top + most, 0.0), -most) if top > -inf else 0.0
