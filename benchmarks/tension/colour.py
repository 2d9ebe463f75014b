"""Surface tension as a force on a colour function (Brackbill et al. 1992, Morris 2000), for a liquid without a gas.

The colour is one in the liquid and decreases towards the surface when it is smoothed by the kernel. Normals are its
gradient, corrected by the inverse matrix of moments (Bonet & Lok 1999), used where |grad c| h exceeds Morris's 0.01.
The curvature is the divergence of the unit normals over these particles, scaled as by Adami et al. (2010), which is
also correct near a surface. The force acts in a layer given by the gradient of the colour itself, the sum of V grad W,
whose integral over the liquid is one half; the other half would be the gas. The liquid carries the whole force, as with
the density-weighted force of Brackbill et al.

At a wall the colour continues in its mirror images. Within the kernel support of the wall, normals are turned towards
the contact angle (Breinlinger et al. 2013); images, whose normals would have another angle, are excluded there.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numba import prange

from benchmarks.tension.lists import Untracked, looped
from reflowshock.arrays import Floats
from reflowshock.particles.sph.fluid_state import Fields
from reflowshock.particles.sph.particle_pairs import compiled
from reflowshock.particles.sph.particle_rates import solved
from reflowshock.particles.sph.smoothing import SUPPORT, shape, slope

# Threshold of the colour gradient over 1 / h; smaller gradients have no reliable direction (Morris 2000).
LEAST_SLOPE = 0.01


@dataclass(slots=True)
class ColourFunction(Untracked):
    """Surface tension by a colour function."""

    def accelerations(self, points: Floats, fields: Fields) -> Floats:
        """Return the accelerations, as ``Untracked.accelerations``."""
        lists, count = self.lists.update(points, points), len(points)
        colour, curvature = np.empty(count), np.empty(count)
        layer, gradient, normal = np.empty((3, count)), np.empty((3, count)), np.zeros((3, count))
        _smooth(lists, fields, self.law, colour, layer)
        _gradients(lists, fields, self.law, (colour, layer), gradient)
        _normals(fields, self.law, self.cosine, gradient, normal)
        _curvatures(lists, fields, self.law, normal, curvature)
        thickness = np.linalg.norm(layer, axis=0)
        return -2.0 * self.tension * curvature * thickness * normal / fields.density[:count]


@compiled
def apart(fields, i, j, side):
    """Return the vector (x, y, z) from particle j, or from its mirror image, to particle i, three scalars [m].

    Periodic images are left out, since they would cost a sixth more.

    Args:
        fields: ``Fields``: arrays of the values of all particles.
        i: Number of the first particle, integer.
        j: Number of the second particle, integer.
        side: 1 for particle j, -1 for its image behind the plane z = 0.
    """
    return fields.x[i] - fields.x[j], fields.y[i] - fields.y[j], fields.z[i] - side * fields.z[j]


@looped
def _smooth(lists, fields, law, colour, layer):
    """Compute the smoothed colour, sum of V W, and the sum of V grad W [1/m], shape (3, n), images included."""
    offsets, indices = lists
    for i in prange(colour.shape[0]):
        total = gx = gy = gz = 0.0
        for image in range(1 + (law.mirror if fields.z[i] < SUPPORT * law.length else 0)):
            for k in range(offsets[i], offsets[i + 1]):
                j = indices[k]
                dx, dy, dz = apart(fields, i, j, 1.0 - 2.0 * image)
                q = sqrt(dx * dx + dy * dy + dz * dz) / law.length
                volume = law.norm * fields.mass[j] / fields.density[j]
                total += volume * shape(law.kernel, False, q)
                steep = volume / law.length**2 * slope(law.kernel, False, q)
                gx, gy, gz = gx + steep * dx, gy + steep * dy, gz + steep * dz
        colour[i], layer[0, i], layer[1, i], layer[2, i] = total, gx, gy, gz


@looped
def _gradients(lists, fields, law, smoothed, gradient):
    """Compute the corrected gradient of the smoothed colour, shape (3, n); uncorrected where neighbours are too few."""
    (offsets, indices), (colour, layer) = lists, smoothed
    for i in prange(colour.shape[0]):
        bx = by = bz = xx = yy = zz = xy = yz = xz = 0.0
        for image in range(1 + (law.mirror if fields.z[i] < SUPPORT * law.length else 0)):
            for k in range(offsets[i], offsets[i + 1]):
                j = indices[k]
                dx, dy, dz = apart(fields, i, j, 1.0 - 2.0 * image)
                q = sqrt(dx * dx + dy * dy + dz * dz) / law.length
                weight = law.norm / law.length**2 * slope(law.kernel, False, q) * fields.mass[j] / fields.density[j]
                jump = weight * (colour[j] - colour[i])
                bx, by, bz = bx + jump * dx, by + jump * dy, bz + jump * dz
                xx, yy, zz = xx - weight * dx * dx, yy - weight * dy * dy, zz - weight * dz * dz
                xy, yz, xz = xy - weight * dx * dy, yz - weight * dy * dz, xz - weight * dx * dz
        gx, gy, gz = solved((xx, yy, zz, xy, yz, xz), (bx, by, bz), 3)
        if gx == 0.0 and gy == 0.0 and gz == 0.0:
            gx, gy, gz = layer[0, i], layer[1, i], layer[2, i]
        gradient[0, i], gradient[1, i], gradient[2, i] = gx, gy, gz


@looped
def _normals(fields, law, cosine, gradient, normal):
    """Compute outward unit normals, shape (3, n), zero without a direction, turned to the contact angle near a wall."""
    sine, reach = sqrt(1.0 - cosine * cosine), SUPPORT * law.length
    for i in prange(normal.shape[1]):
        nx, ny, nz = -gradient[0, i], -gradient[1, i], -gradient[2, i]
        size = sqrt(nx * nx + ny * ny + nz * nz)
        if size * law.length <= LEAST_SLOPE:
            continue
        nx, ny, nz = nx / size, ny / size, nz / size
        along = sqrt(nx * nx + ny * ny)
        if law.mirror and fields.z[i] < reach and along > 0.0:
            share = fields.z[i] / reach
            nx, ny = (share + (1.0 - share) * sine / along) * nx, (share + (1.0 - share) * sine / along) * ny
            nz = share * nz + (1.0 - share) * cosine
            turned = sqrt(nx * nx + ny * ny + nz * nz)
            nx, ny, nz = nx / turned, ny / turned, nz / turned
        normal[0, i], normal[1, i], normal[2, i] = nx, ny, nz


@looped
def _curvatures(lists, fields, law, normal, curvature):
    """Compute the divergence [1/m] of the normals, shape (n,), over the particles with a normal."""
    offsets, indices = lists
    for i in prange(curvature.shape[0]):
        rise = scale = 0.0
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            dx, dy, dz = apart(fields, i, j, 1.0)
            distance2 = dx * dx + dy * dy + dz * dz
            counts = normal[0, j] ** 2 + normal[1, j] ** 2 + normal[2, j] ** 2  # 1 with a normal, otherwise 0
            weight = (
                counts * slope(law.kernel, False, sqrt(distance2) / law.length) * fields.mass[j] / fields.density[j]
            )
            scale -= weight * distance2
            turn = (normal[0, j] - normal[0, i]) * dx + (normal[1, j] - normal[1, i]) * dy
            rise += weight * (turn + (normal[2, j] - normal[2, i]) * dz)
        curvature[i] = 3.0 * rise / scale if scale > 0.0 else 0.0
