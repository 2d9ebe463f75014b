"""Sums over the neighbours of one particle, written so that a GPU can compile them too.

The order of the neighbours is the order of the sum, so that the number of threads changes nothing.
"""

from math import floor, sqrt

import numpy as np
from numba import njit

from reflowshock.particles.sph import pair_terms
from reflowshock.particles.sph.smoothing import shape, slope

# Of the determinant of the matrix of moments, which is one inside the liquid: with less the gradient is not resolved.
FEWEST_MOMENTS = 0.05
# Added in the sums that shift particles, which it keeps from pairing (Monaghan 2000): factor and power.
PAIRING, POWER = 0.2, 4


@njit(cache=True, error_model="numpy")
def across(distance, period):
    """Return a component of a vector between particles [m] to the nearest image; a period of 0 is none."""
    return distance - period * floor(distance / period + 0.5) if period > 0.0 else distance


@njit(cache=True, error_model="numpy")
def positive(value):
    """Return a value, or zero where it is negative; Numba 0.68 cannot compile `max` for a GPU."""
    return value if value > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def seen(n, i, neighbours, mirror):
    """Return the n-th that a particle sees, and -1 for an image, else 1: two of each at a mirror, and its own."""
    row = n >> mirror
    if row == len(neighbours):
        return np.int64(i), -1.0
    return np.int64(neighbours[row]), 1.0 - 2.0 * (n & mirror)


@njit(cache=True, error_model="numpy")
def closing_in(k, velocity, d, fields):
    """Return (u_i - u_j) . d for the k-th particle of walls; what comes near one with a share meets its image."""
    u, v, w = velocity[0] - fields.wall_u[k], velocity[1] - fields.wall_v[k], velocity[2] - fields.wall_w[k]
    closing = u * d[0] + v * d[1] + w * d[2]
    return 2.0 * closing if fields.wall_room[k] > 0.0 else closing


@njit(cache=True, error_model="numpy")
def viscosity_between(i, j, fluids, fields, law):
    """Return the viscosity between two particles [Pa s]; beside a wall it is the liquid's."""
    if law.rheology == 0 or j >= fluids:
        return fields.viscosity[i] if law.rheology else law.viscosity
    return pair_terms.shared_viscosity(fields.viscosity[i], fields.viscosity[j])


@njit(cache=True, error_model="numpy")
def rates_of(i, fluids, neighbours, fields, law):
    """Return what a particle of the liquid is told by its neighbours.

    Args:
        i: the particle.
        fluids: number of particles that are liquid.
        neighbours: its list.
        fields: `Fields`.
        law: `Law`.

    Returns:
        rate of density, acceleration (3), renormalised gradient of the density (3), gradient of the concentration of
        particles (3) [1/m].
    """
    x, y, z, u, v, w = fields.x[i], fields.y[i], fields.z[i], fields.u[i], fields.v[i], fields.w[i]
    density, pressure = fields.density[i], fields.pressure[i]
    gx, gy, gz = fields.slope_x[i], fields.slope_y[i], fields.slope_z[i]
    line = law.dimension == 1
    inverse = 1.0 / law.length
    scale = law.norm * inverse * inverse
    softening = pair_terms.SOFTENING * law.length * law.length
    level = shape(law.kernel, line, law.spacing * inverse)
    rate = ax = ay = az = cx = cy = cz = 0.0
    bx = by = bz = xx = yy = zz = xy = yz = xz = 0.0
    mirror = law.mirror if z < 2.0 * law.length else 0
    for n in range((1 + mirror) * len(neighbours) + mirror):
        j, side = seen(n, i, neighbours, mirror)
        dx = across(x - fields.x[j], law.period_x)
        dy = across(y - fields.y[j], law.period_y)
        dz = across(z - side * fields.z[j], law.period_z)
        distance2 = dx * dx + dy * dy + dz * dz
        q = sqrt(distance2) * inverse
        if q >= 2.0:
            continue
        steep = scale * slope(law.kernel, line, q)
        beside = fields.density[j]
        volume = fields.mass[j] / beside
        liquid = j < fluids
        hold = side if law.no_slip else 1.0  # an image moves on along the wall, or back
        approach = (u - hold * fields.u[j]) * dx + (v - hold * fields.v[j]) * dy + (w - side * fields.w[j]) * dz
        closing = approach + (hold - 1.0) * (fields.u[j] * dx + fields.v[j] * dy)
        if not liquid:
            closing = closing_in(j - fluids, (u, v, w), (dx, dy, dz), fields)
            volume *= fields.wall_share[j - fluids]
        rate += pair_terms.continuity(closing, steep, volume, density)
        own = positive(pressure) if law.has_surface and not liquid else pressure  # walls do not pull
        other = fields.pressure[j] + (side - 1.0) * law.gravity_z * fields.z[j] * beside  # an image has more weight
        push = pair_terms.pressure(own, other, steep, volume, density)
        if law.artificial > 0.0 and liquid:
            push += law.artificial * pair_terms.artificial_viscosity(approach, distance2, steep, volume, density)
        if law.viscosity > 0.0 and (liquid or law.no_slip):
            softened2, double = distance2 + softening, 2.0 * viscosity_between(i, j, fluids, fields, law) / density
            if law.has_surface:
                factor = double * (law.dimension + 2)
                push += pair_terms.central_viscosity(approach, softened2, steep, volume, factor)
            else:
                drag = pair_terms.shear_viscosity(distance2, softened2, steep, volume, double)
                ax += drag * (u - fields.u[j])
                ay += drag * (v - fields.v[j])
                az += drag * (w - fields.w[j])
        if law.diffusion > 0.0 and liquid:
            jump = beside - density
            ex, ey, ez = gx + fields.slope_x[j], gy + fields.slope_y[j], gz + side * fields.slope_z[j]
            rise = -0.5 * (ex * dx + ey * dy + ez * dz)
            rate += law.diffusion * pair_terms.density_diffusion(jump, rise, steep, volume)
            weight = steep * volume
            bx += jump * weight * dx
            by += jump * weight * dy
            bz += jump * weight * dz
            xx -= weight * dx * dx
            yy -= weight * dy * dy
            zz -= weight * dz * dz
            xy -= weight * dx * dy
            yz -= weight * dy * dz
            xz -= weight * dx * dz
        if law.shifting > 0.0:
            crowd = steep * volume * (1.0 + PAIRING * (shape(law.kernel, line, q) / level) ** POWER)
            cx += crowd * dx
            cy += crowd * dy
            cz += crowd * dz
        ax += push * dx
        ay += push * dy
        az += push * dz
    if law.diffusion > 0.0:
        bx, by, bz = solved((xx, yy, zz, xy, yz, xz), (bx, by, bz), law.dimension)
    return rate, ax, ay, az, bx, by, bz, cx, cy, cz


@njit(cache=True, error_model="numpy")
def drift_of(i, fluids, neighbours, fields, law):
    """Return the velocity (3) [m/s] that XSPH adds where it moves a particle of the liquid; momentum stays."""
    x, y, z, u, v, w = fields.x[i], fields.y[i], fields.z[i], fields.u[i], fields.v[i], fields.w[i]
    inverse = 1.0 / law.length
    fu = fv = fw = 0.0
    mirror = law.mirror if z < 2.0 * law.length else 0
    for n in range((1 + mirror) * len(neighbours) + mirror):
        j, side = seen(n, i, neighbours, mirror)
        if j >= fluids:
            continue
        dx = across(x - fields.x[j], law.period_x)
        dy = across(y - fields.y[j], law.period_y)
        dz = across(z - side * fields.z[j], law.period_z)
        level = law.norm * shape(law.kernel, law.dimension == 1, sqrt(dx * dx + dy * dy + dz * dz) * inverse)
        weight = law.xsph * pair_terms.xsph(level, fields.mass[j], fields.density[i], fields.density[j])
        fu += weight * (fields.u[j] - u)
        fv += weight * (fields.v[j] - v)
        fw += weight * (side * fields.w[j] - w)
    return fu, fv, fw


@njit(cache=True, error_model="numpy")
def solved(moments, sums, dimension):
    """Return the gradient `moments^-1 sums`, in a plane that of x and z; zero where neighbours do not resolve it."""
    xx, yy, zz, xy, yz, xz = moments
    bx, by, bz = sums
    if dimension == 1:
        return (bx / xx, 0.0, 0.0) if xx > FEWEST_MOMENTS else (0.0, 0.0, 0.0)
    if dimension == 2:
        determinant = xx * zz - xz * xz
        if determinant <= FEWEST_MOMENTS:
            return 0.0, 0.0, 0.0
        return (zz * bx - xz * bz) / determinant, 0.0, (xx * bz - xz * bx) / determinant
    ax, ay, az = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    determinant = xx * ax + xy * ay + xz * az
    if determinant <= FEWEST_MOMENTS:
        return 0.0, 0.0, 0.0
    by_y, by_z, bz_z = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    return (
        (ax * bx + ay * by + az * bz) / determinant,
        (ay * bx + by_y * by + by_z * bz) / determinant,
        (az * bx + by_z * by + bz_z * bz) / determinant,
    )


@njit(cache=True, error_model="numpy")
def wall_values(i, fluids, neighbours, fields, law):
    """Return pressure, velocity (3) and share of a particle of a wall, from the liquid beside it (Adami et al. 2012).

    The pressure is that of the liquid, with its weight; where the liquid has a free surface a wall does not pull at
    what leaves it. The velocity is the wall's less that of the liquid against it: at the wall's face it is the wall's.
    The share is how much of it counts; see `Fields`.
    """
    x, y, z = fields.x[i], fields.y[i], fields.z[i]
    line = law.dimension == 1
    inverse = 1.0 / law.length
    total = liquid = pressure = u = v = w = 0.0
    mirror = law.mirror if z < 2.0 * law.length else 0
    for n in range((1 + mirror) * len(neighbours)):
        j, side = seen(n, i, neighbours, mirror)
        if j >= fluids:
            continue
        hold = side if law.no_slip else 1.0
        dx = across(x - fields.x[j], law.period_x)
        dy = across(y - fields.y[j], law.period_y)
        dz = across(z - side * fields.z[j], law.period_z)
        weight = shape(law.kernel, line, sqrt(dx * dx + dy * dy + dz * dz) * inverse)
        total += weight
        liquid += weight * fields.mass[j] / fields.density[j]
        fall = law.gravity_x * dx + law.gravity_y * dy + law.gravity_z * (z - fields.z[j])
        pressure += weight * (fields.pressure[j] + fields.density[j] * fall)
        u += weight * hold * fields.u[j]
        v += weight * hold * fields.v[j]
        w += weight * side * fields.w[j]
    k = i - fluids
    if total <= 0.0:
        return 0.0, fields.wall_u[k], fields.wall_v[k], fields.wall_w[k], 0.0
    u, v, w = 2.0 * fields.wall_u[k] - u / total, 2.0 * fields.wall_v[k] - v / total, 2.0 * fields.wall_w[k] - w / total
    pressure /= total
    room, share = fields.wall_room[k], 1.0
    if room > law.norm * liquid:
        share = law.norm * liquid / room
    return positive(pressure) if law.has_surface else pressure, u, v, w, share
