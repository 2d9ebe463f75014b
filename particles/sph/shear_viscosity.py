"""Shear-dependent viscosity, for threads and CUDA: power law and Carreau, with the shear rate at a particle.

The shear rate is sqrt(2 D : D) of the renormalised velocity gradient. ``parameters/rheology.py`` has the parameters.
"""

from math import sqrt

from numba import uint32

from reflowshock.particles.sph.particle_pairs import apart, compiled, liquid_among, periods_of, summed
from reflowshock.particles.sph.particle_rates import solved
from reflowshock.particles.sph.smoothing import slope

NEWTON, POWER_LAW, CARREAU = 0, 1, 2
LAWS = {"power_law": POWER_LAW, "carreau": CARREAU}


@compiled
def viscosity_at(rate, law):
    """Return the viscosity [Pa s] at a shear rate, a scalar.

    Args:
        rate: Shear rate, scalar [1/s].
        law: ``Law``: constants of the particles, with the viscosity law, its exponent, reference rate and bounds.
    """
    ratio = rate / law.shear_rate
    if law.rheology == CARREAU:
        share = (1.0 + ratio * ratio) ** (0.5 * (law.exponent - 1.0))
        return law.least_viscosity + (law.viscosity - law.least_viscosity) * share
    if law.exponent == 1.0:
        return law.viscosity
    bounded = law.viscosity * ratio ** (law.exponent - 1.0) if ratio > 0.0 else law.most_viscosity
    if (ratio <= 0.0 and law.exponent > 1.0) or bounded < law.least_viscosity:
        return law.least_viscosity
    return bounded if bounded < law.most_viscosity else law.most_viscosity


@summed
def viscosity_of(i, fluids, neighbours, fields, law):
    """Return the viscosity [Pa s] of a liquid particle from the renormalised velocity gradient, a scalar.

    Wall particles count, with their extrapolated velocities, at no-slip walls only.

    Args:
        i: Number of the particle, integer.
        fluids: Number of liquid particles, integer.
        neighbours: Numbers of its neighbours, liquid ones first, shape (k,).
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        law: ``Law``: constants of the particles, such as kernel and smoothing length, with the viscosity law.
    """
    x, y, z, u, v, w = fields.x[i], fields.y[i], fields.z[i], fields.u[i], fields.v[i], fields.w[i]
    inverse = 1.0 / law.length
    scale = law.norm * inverse * inverse
    ux = uy = uz = vx = vy = vz = wx = wy = wz = 0.0
    xx = yy = zz = xy = yz = xz = 0.0
    periods = periods_of(law)
    count = len(neighbours) if law.no_slip else liquid_among(neighbours, fluids)
    for image in range(1 + (law.mirror if z < 2.0 * law.length else 0)):
        side = 1.0 - 2.0 * image
        hold = side if law.no_slip else 1.0
        for n in range(count):
            j = uint32(neighbours[n])
            dx, dy, dz = apart((x, y, z), j, side, fields, periods)
            steep = scale * slope(law.kernel, law.dimension == 1, sqrt(dx * dx + dy * dy + dz * dz) * inverse)
            weight = steep * fields.mass[j] / fields.density[j]
            ju, jv, jw = hold * fields.u[j] - u, hold * fields.v[j] - v, side * fields.w[j] - w
            ux, uy, uz = ux + weight * ju * dx, uy + weight * ju * dy, uz + weight * ju * dz
            vx, vy, vz = vx + weight * jv * dx, vy + weight * jv * dy, vz + weight * jv * dz
            wx, wy, wz = wx + weight * jw * dx, wy + weight * jw * dy, wz + weight * jw * dz
            xx, yy, zz = xx - weight * dx * dx, yy - weight * dy * dy, zz - weight * dz * dz
            xy, yz, xz = xy - weight * dx * dy, yz - weight * dy * dz, xz - weight * dx * dz
    moments = (xx, yy, zz, xy, yz, xz)
    ux, uy, uz = solved(moments, (ux, uy, uz), law.dimension)
    vx, vy, vz = solved(moments, (vx, vy, vz), law.dimension)
    wx, wy, wz = solved(moments, (wx, wy, wz), law.dimension)
    stretch = 2.0 * (ux * ux + vy * vy + wz * wz)
    return viscosity_at(sqrt(stretch + (uy + vx) ** 2 + (vz + wy) ** 2 + (uz + wx) ** 2), law)
