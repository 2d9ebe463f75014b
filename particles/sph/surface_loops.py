"""Loops between the vertices of a liquid's surface and the particles beside them.

A vertex moves with the mean velocity of the particles within the support, weighted by Wendland's kernel; its force is
shared among the same particles by the same weights. So the work of the forces is that of the particles, and momentum
is kept. Above a wall in z = 0 the images of particles count too: they move and are pushed as in a mirror.
"""

from math import sqrt

from numba import njit, prange

from reflowshock.particles.sph.smoothing import WENDLAND_C2, shape


@njit(cache=True, parallel=True)
def find_shares(points, lists, fields, law, shares):
    """Write the weight of each particle beside a vertex into ``shares`` `(2, pairs)`; those of a vertex add to one.

    The first row is for components along a wall, the second for those across it, in which images are reversed. A vertex
    without particles has weights of zero.
    """
    offsets, indices = lists
    inverse = 1.0 / law.length
    for v in prange(points.shape[0]):
        total = 0.0
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            dx, dy, dz = points[v, 0] - fields.x[j], points[v, 1] - fields.y[j], points[v, 2] - fields.z[j]
            own, image = shape(WENDLAND_C2, False, sqrt(dx * dx + dy * dy + dz * dz) * inverse), 0.0
            if law.mirror:
                dz = points[v, 2] + fields.z[j]
                image = shape(WENDLAND_C2, False, sqrt(dx * dx + dy * dy + dz * dz) * inverse)
            shares[0, k], shares[1, k] = own + image, own - image
            total += own + image
        for k in range(offsets[v], offsets[v + 1]):
            shares[0, k] = shares[0, k] / total if total > 0.0 else 0.0
            shares[1, k] = shares[1, k] / total if total > 0.0 else 0.0


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
def share_forces(lists, shares, forces, mass, pushes):
    """Add the accelerations by forces on vertices `(m, 3)` to those of the particles, ``pushes`` `(3, n)`."""
    offsets, indices = lists
    for v in range(forces.shape[0]):
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            along, across = shares[0, k] / mass[j], shares[1, k] / mass[j]
            pushes[0, j] += along * forces[v, 0]
            pushes[1, j] += along * forces[v, 1]
            pushes[2, j] += across * forces[v, 2]
