"""Loops between the vertices of a liquid's surface and the particles beside them.

A vertex moves with the mean velocity of the particles within the support, weighted by their kernel; its force is
shared among the same particles by the same weights. So the work of the forces is that of the particles, and momentum
is kept. Above a wall in z = 0 the images of particles count too: they move and are pushed as in a mirror.
"""

from math import inf, sqrt

from numba import njit, prange

from reflowshock.particles.sph.smoothing import shape


@njit(cache=True, parallel=True)
def find_weights(points, lists, fields, law, weights):
    """Write the kernel W between each vertex and the particles beside it into ``weights`` `(2, pairs)` [1/m^3].

    The first row is for components along a wall, the second for those across it, in which images are reversed.
    """
    offsets, indices = lists
    inverse = 1.0 / law.length
    for v in prange(points.shape[0]):
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            dx, dy, dz = points[v, 0] - fields.x[j], points[v, 1] - fields.y[j], points[v, 2] - fields.z[j]
            own, image = shape(law.kernel, False, sqrt(dx * dx + dy * dy + dz * dz) * inverse), 0.0
            if law.mirror:
                dz = points[v, 2] + fields.z[j]
                image = shape(law.kernel, False, sqrt(dx * dx + dy * dy + dz * dz) * inverse)
            weights[0, k], weights[1, k] = law.norm * (own + image), law.norm * (own - image)


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


@njit(cache=True)
def share_out(lists, shares, vectors, found):
    """Add what each particle has of the vectors of vertices `(m, 3)` to ``found`` `(3, n)`."""
    offsets, indices = lists
    for v in range(vectors.shape[0]):
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            found[0, j] += shares[0, k] * vectors[v, 0]
            found[1, j] += shares[0, k] * vectors[v, 1]
            found[2, j] += shares[1, k] * vectors[v, 2]


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
        strays[v] = max(top + least, min(top + most, 0.0)) if top > -inf else 0.0
