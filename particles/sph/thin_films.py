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
from reflowshock.particles.sph.surface_loops import share_out

# In spacings above the wall: higher particles have others between themselves and the wall.
LOWEST = 0.75
# Of the rate at which sound crosses the smoothing length: a stronger drag is not stable in a step.
STRONGEST = 2.0


def hold_films(
    surface: tuple[Floats, tuple[Indices, Indices], Floats], fields: Fields, law: Law, rates: Floats
) -> None:
    """Take the friction of the wall z = 0 that sums over pairs lack from the accelerations along it.

    Args:
        surface: its vertices `(m, 3)` [m], the particles beside each, and the kernel between them `(2, pairs)` [1/m^3].
        fields: of the particles.
        law: of the particles.
        rates: of the liquid `(10, n)`; rows 1 and 2 change.
    """
    points, lists, weights = surface
    heights, sums = np.ones_like(points), np.zeros((3, len(fields.x)))
    heights[:, 1] = points[:, 2]
    share_out(lists, weights, heights, sums)
    _hold(sums, fields, law, rates)


@njit(cache=True)
def _hold(sums, fields, law, rates):
    """Do so with the sums of the kernel, and of it times the heights of vertices, in rows 0 and 1 of ``sums``."""
    for i in range(rates.shape[1]):
        z = fields.z[i]
        if sums[0, i] == 0.0 or z > LOWEST * law.spacing:
            continue
        height, viscosity = max(sums[1, i] / sums[0, i], z), own_viscosity(i, fields, law) / fields.density[i]
        by_images = 8.0 * pi * height * law.norm * shape(law.kernel, False, 2.0 * z / law.length)
        lacking = viscosity * max(3.0 / (height * height) - by_images, 0.0)
        drag = min(lacking, STRONGEST * law.sound / law.length)
        rates[1, i] -= drag * fields.u[i]
        rates[2, i] -= drag * fields.v[i]
