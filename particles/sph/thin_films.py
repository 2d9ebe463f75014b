"""Wall friction on films that are one particle thin.

In a film of thickness H on a no-slip wall the velocity is a parabola, and the wall's friction on the mean velocity u is
3 mu u / H a unit of area (lubrication; Nusselt's film). A single particle between the wall and the surface has this
mean velocity, and the sums over pairs see nothing of the wall but its image. Integrated over a layer of images at the
distance 2 z, they give 8 pi mu H W(2 z) u a unit of volume in place of 3 mu u / H^2: a factor of 1.8 too little where H
is one spacing, of 12 where it is half of one. The difference is added; from H = 1.35 spacings on it vanishes.
"""

from math import pi

import numpy as np
from numba import njit

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.particle_rates import own_viscosity
from reflowshock.particles.sph.smoothing import shape

# Height above the wall in spacings beyond which other particles are between a particle and the wall.
LOWEST = 0.75
# Largest drag over the rate at which sound crosses the smoothing length; a stronger one is unstable in a time step.
STRONGEST = 2.0
# A vertex is level if its unit normal has more than the first component across the wall; a film is where more than the
# second share of the surface is level. Rims and liquid that rolls over a contact line are excluded.
LEVEL, MOST = 0.7, 0.5


def sum_film_surface(
    points: Floats, normals: Floats, lists: tuple[Indices, Indices], kernel: Floats, particles: int
) -> Floats:
    """Sum the kernel over the surface vertices near each particle, to recognise films and measure their height.

    Args:
        points: Vertices, shape (m, 3) [m].
        normals: Outward unit normals, shape (m, 3), along the wall on contact lines.
        lists: Particles near each vertex in compressed rows: offsets, shape (m + 1,), and indices, shape (pairs,).
        kernel: Kernel between each vertex and its particles, shape (pairs,) [1/m^3].
        particles: Number of all particles.

    Returns:
        Rows, shape (3, particles): kernel summed over all vertices [1/m^3], over level ones (vertical component of the
        normal above 0.7) [1/m^3], and over level ones times their height [1/m^2].
    """
    sums = np.zeros((3, particles))
    _sum_surface(points, normals, lists, kernel, sums)
    return sums


@njit(cache=True)
def _sum_surface(points, normals, lists, kernel, sums):
    """Add the sums of ``sum_film_surface``."""
    offsets, indices = lists
    for v in range(points.shape[0]):
        is_level = normals[v, 2] > LEVEL
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            sums[0, j] += kernel[k]
            if is_level:
                sums[1, j] += kernel[k]
                sums[2, j] += kernel[k] * points[v, 2]


@njit(cache=True)
def add_wall_friction(sums: Floats, fields: Fields, law: Law, rates: Floats) -> None:
    """Subtract the friction of the wall z = 0 that mirrored particles do not resolve in thin films.

    A film is a thin layer below a mostly level surface. Its friction after lubrication theory is 3 mu / H^2 times the
    velocity; the share that the mirrored particles already give is not subtracted again.

    Args:
        sums: Kernel summed over all surface vertices, over level ones [1/m^3], and over level ones times their height
            [1/m^2], shape (3, particles).
        fields: Arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        law: Parameters of the pair interactions, such as kernel, smoothing length and density.
        rates: Rates of the n liquid particles, shape (10, n); rows 1 and 2, the acceleration along x and y [m/s^2],
            change.
    """
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
