"""Friction of a wall on films that are one particle thin.

In a film of thickness H that a wall holds, the velocity is a parabola, and the wall's friction on the mean velocity u
is 3 mu u / H a unit of area (lubrication; Nusselt's film). Where there is one particle between the wall and the
surface, it has this mean velocity, and all that the sums over pairs know of the wall is its image. Their viscosity,
integrated over a layer of images in the distance 2 z, gives 8 pi mu H W(2 z) u a unit of volume in place of 3 mu u /
H^2: 1.8 times too little where H is a spacing, twelve times where it is half of one. What they lack is added; from H =
1.35 spacings on they lack nothing.
"""

from math import pi

import numpy as np
from numba import njit

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.particle_rates import own_viscosity
from reflowshock.particles.sph.smoothing import shape

# In spacings above the wall: higher particles have others between themselves and the wall.
LOWEST = 0.75
# Of the rate at which sound crosses the smoothing length: a stronger drag is not stable in a step.
STRONGEST = 2.0
# A surface whose normal has more than this across the wall is level, and a film where more than this share of it is so;
# at rims, and where liquid rolls over a contact line, nothing flows as in a film.
LEVEL, MOST = 0.7, 0.5


def hold_films(
    surface: tuple[Floats, Floats, tuple[Indices, Indices], Floats], fields: Fields, law: Law, rates: Floats
) -> None:
    """Take the friction of the wall z = 0 that sums over pairs lack from the accelerations along it.

    Args:
        surface: its vertices `(m, 3)` [m] and outward normals `(m, 3)`, none across the wall on contact lines, the
            particles beside each, and the kernel between them `(2, pairs)` [1/m^3].
        fields: of the particles.
        law: of the particles.
        rates: of the liquid `(10, n)`; rows 1 and 2 change.
    """
    points, normals, lists, weights = surface
    sums = np.zeros((3, len(fields.x)))
    _sum(points, normals, lists, weights[0], sums)
    _hold(sums, fields, law, rates)


@njit(cache=True)
def _sum(points, normals, lists, weights, sums):
    """Add the kernel about each particle, all of it and that of level vertices, and this times their heights."""
    offsets, indices = lists
    for v in range(points.shape[0]):
        is_level = normals[v, 2] > LEVEL
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            sums[0, j] += weights[k]
            if is_level:
                sums[1, j] += weights[k]
                sums[2, j] += weights[k] * points[v, 2]


@njit(cache=True)
def _hold(sums, fields, law, rates):
    """Hold the particles next to the wall that are in films: most of the surface about them is level."""
    for i in range(rates.shape[1]):
        z = fields.z[i]
        if z > LOWEST * law.spacing or sums[1, i] <= MOST * sums[0, i]:
            continue
        height, viscosity = max(sums[2, i] / sums[1, i], z), own_viscosity(i, fields, law) / fields.density[i]
        by_images = 8.0 * pi * height * law.norm * shape(law.kernel, False, 2.0 * z / law.length)
        lacking = viscosity * max(3.0 / (height * height) - by_images, 0.0)
        drag = min(lacking, STRONGEST * law.sound / law.length)
        rates[1, i] -= drag * fields.u[i]
        rates[2, i] -= drag * fields.v[i]
