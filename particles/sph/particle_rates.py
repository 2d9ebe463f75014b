"""Sums over the neighbours of one particle, compiled for threads and for CUDA.

The order of a sum does not depend on the number of threads. Indices are unsigned in the loops, since negative indices
would count from the end.
"""

from math import inf, sqrt

from numba import uint32

from reflowshock.particles.sph import pair_terms
from reflowshock.particles.sph.fluid_state import REPRODUCING
from reflowshock.particles.sph.particle_pairs import (
    apart,
    compiled,
    constants_of,
    liquid_among,
    periods_of,
    positive,
    summed,
)
from reflowshock.particles.sph.smoothing import shape, slope

# Least determinant of the matrix of moments, which is one inside the liquid, for a resolved gradient.
FEWEST_MOMENTS = 0.05
# Largest condition number of the linear fit, and number of neighbours that it must exceed; otherwise the slope is zero.
LARGEST_CONDITION, FEWEST_NEIGHBOURS = 1e3, 5


@compiled
def closing_in(k, velocity, d, fields):
    """Return (u_i - u_j) . d of a liquid and a wall particle, a scalar [m^2/s].

    It is doubled for wall particles with a weight, which act as mirror images.

    Args:
        k: Number of the wall particle j among the wall particles, integer.
        velocity: Velocity u_i (x, y, z) of a liquid particle i [m/s].
        d: Vector (x, y, z) from the wall particle to particle i [m].
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
    """
    u, v, w = velocity[0] - fields.wall_u[k], velocity[1] - fields.wall_v[k], velocity[2] - fields.wall_w[k]
    closing = u * d[0] + v * d[1] + w * d[2]
    return 2.0 * closing if fields.wall_room[k] > 0.0 else closing


@compiled
def pulls_not(law):
    """Return whether walls cannot pull at the liquid, a boolean: if it has a free surface that is not tracked.

    Args:
        law: ``Law``: constants of the particles, of which ``has_surface`` and ``tracked`` (0 or 1) are read.
    """
    return law.has_surface and not law.tracked


@compiled
def own_viscosity(i, fields, law):
    """Return the viscosity of one particle, a scalar [Pa s]; 0 if viscosity does not act.

    Args:
        i: Number of the particle, integer.
        fields: ``Fields``: arrays of the values of all particles; ``viscosity`` is read if it depends on the shear
            rate.
        law: ``Law``: constants of the particles, with the constant viscosity and the number of the viscosity law.
    """
    return positive(fields.viscosity[i] if law.rheology else law.viscosity)


@compiled
def rates_of(i, fluids, neighbours, fields, law):
    """Return the rates of density and velocity of a liquid particle, and two gradients, from its neighbours.

    A particle is in its own row because of its mirror image; the pair with itself contributes nothing.

    Args:
        i: Number of the particle, integer.
        fluids: Number of liquid particles, integer.
        neighbours: Numbers of its neighbours, liquid ones first, shape (k,).
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        law: ``Law``: constants of the particles, such as kernel, smoothing length, density and speed of sound.

    Returns:
        Tuple of ten scalars: rate of density [kg/(m^3 s)], acceleration (3) [m/s^2], density gradient (3) [kg/m^4],
        gradient of the concentration of particles (3) [1/m].
    """
    liquid = liquid_among(neighbours, fluids)
    rate, ax, ay, az, cx, cy, cz, bx, by, bz, xx, yy, zz, xy, yz, xz = _by_liquid(i, neighbours[:liquid], fields, law)
    if liquid < len(neighbours):
        wall = _by_walls(i, fluids, neighbours[liquid:], fields, law)
        rate, ax, ay, az = rate + wall[0], ax + wall[1], ay + wall[2], az + wall[3]
        cx, cy, cz = cx + wall[4], cy + wall[5], cz + wall[6]
    if law.diffusion > 0.0 and law.gradient == REPRODUCING:
        bx, by, bz = fitted_slope(i, neighbours[:liquid], fields, law)
    elif law.diffusion > 0.0:
        bx, by, bz = solved((xx, yy, zz, xy, yz, xz), (bx, by, bz), law.dimension)
    else:
        bx = by = bz = 0.0
    return rate, ax + law.gravity_x, ay + law.gravity_y, az + law.gravity_z, bx, by, bz, cx, cy, cz


@summed
def _by_liquid(i, neighbours, fields, law):
    """Return sums over the liquid and its images: density rate, acceleration, concentration, density jumps, moments.

    Pairs have no branch, so that several are computed at a time.
    """
    x, y, z, u, v, w = fields.x[i], fields.y[i], fields.z[i], fields.u[i], fields.v[i], fields.w[i]
    density, pressure, lightness = fields.density[i], fields.pressure[i], 1.0 / fields.density[i]
    gx, gy, gz = fields.slope_x[i], fields.slope_y[i], fields.slope_z[i]
    periods, (line, inverse, scale, softening, peak) = periods_of(law), constants_of(law)
    diffusion, artificial, viscosity = positive(law.diffusion), positive(law.artificial), own_viscosity(i, fields, law)
    along = 2.0 * (law.dimension + 2) * lightness if law.has_surface else 0.0  # over the viscosity of a pair
    aside = 0.0 if law.has_surface else 2.0 * lightness
    rate = ax = ay = az = cx = cy = cz = 0.0
    bx = by = bz = xx = yy = zz = xy = yz = xz = 0.0
    for image in range(1 + (law.mirror if z < 2.0 * law.length else 0)):
        side = 1.0 - 2.0 * image
        hold = side if law.no_slip else 1.0  # an image moves on along the wall, or back
        weight_below = (side - 1.0) * law.gravity_z  # an image has more weight
        held = 0.5 * (1.0 - hold)  # by the wall, with which nothing turns
        turning, sheared = (1.0 - held) * along, (1.0 - held) * aside + held * 2.0 * lightness
        for n in range(len(neighbours)):
            j = uint32(neighbours[n])
            dx, dy, dz = apart((x, y, z), j, side, fields, periods)
            distance2 = dx * dx + dy * dy + dz * dz
            q = sqrt(distance2) * inverse
            steep = scale * slope(law.kernel, line, q)
            beside = fields.density[j]
            volume = fields.mass[j] / beside
            uj, vj, wj = fields.u[j], fields.v[j], side * fields.w[j]
            du, dv, dw = u - hold * uj, v - hold * vj, w - wj
            approach = du * dx + dv * dy + dw * dz
            closing = approach + (hold - 1.0) * (uj * dx + vj * dy)
            rate += pair_terms.continuity(closing, steep, volume, density)
            other = fields.pressure[j] + weight_below * fields.z[j] * beside
            push = pair_terms.pressure(pressure, other, steep, volume, lightness)
            push += artificial * pair_terms.artificial_viscosity(approach, distance2, steep, volume, lightness)
            shared = pair_terms.shared_viscosity(viscosity, fields.viscosity[j]) if law.rheology else viscosity
            nearness = 1.0 / (distance2 + softening)
            push += pair_terms.central_viscosity(approach, nearness, steep, volume, turning * shared)
            drag = pair_terms.shear_viscosity(distance2, nearness, steep, volume, sheared * shared)
            jump = beside - density
            ex, ey, ez = gx + fields.slope_x[j], gy + fields.slope_y[j], gz + side * fields.slope_z[j]
            rise = -0.5 * (ex * dx + ey * dy + ez * dz)
            rate += diffusion * pair_terms.density_diffusion(jump, rise, steep, volume)
            weight = steep * volume
            crowd = weight * pair_terms.crowding(peak * shape(law.kernel, line, q))
            ax, ay, az = ax + push * dx + drag * du, ay + push * dy + drag * dv, az + push * dz + drag * dw
            cx, cy, cz = cx + crowd * dx, cy + crowd * dy, cz + crowd * dz
            bx, by, bz = bx + jump * weight * dx, by + jump * weight * dy, bz + jump * weight * dz
            xx, yy, zz = xx - weight * dx * dx, yy - weight * dy * dy, zz - weight * dz * dz
            xy, yz, xz = xy - weight * dx * dy, yz - weight * dy * dz, xz - weight * dx * dz
    return rate, ax, ay, az, cx, cy, cz, bx, by, bz, xx, yy, zz, xy, yz, xz


@summed
def _by_walls(i, fluids, neighbours, fields, law):
    """Return sums over wall particles and their images: density rate, acceleration, concentration gradient."""
    x, y, z, u, v, w = fields.x[i], fields.y[i], fields.z[i], fields.u[i], fields.v[i], fields.w[i]
    density, pressure, lightness = fields.density[i], fields.pressure[i], 1.0 / fields.density[i]
    periods, (line, inverse, scale, softening, peak) = periods_of(law), constants_of(law)
    own = positive(pressure) if pulls_not(law) else pressure
    viscosity = own_viscosity(i, fields, law) * lightness if law.no_slip else 0.0
    rate = ax = ay = az = cx = cy = cz = 0.0
    for image in range(1 + (law.mirror if z < 2.0 * law.length else 0)):
        side = 1.0 - 2.0 * image
        hold = side if law.no_slip else 1.0
        weight_below = (side - 1.0) * law.gravity_z
        for n in range(len(neighbours)):
            j = uint32(neighbours[n])
            dx, dy, dz = apart((x, y, z), j, side, fields, periods)
            distance2 = dx * dx + dy * dy + dz * dz
            q = sqrt(distance2) * inverse
            steep = scale * slope(law.kernel, line, q)
            beside = fields.density[j]
            volume = fields.mass[j] / beside * fields.wall_share[j - fluids]
            du, dv, dw = u - hold * fields.u[j], v - hold * fields.v[j], w - side * fields.w[j]
            closing = closing_in(j - fluids, (u, v, w), (dx, dy, dz), fields)
            rate += pair_terms.continuity(closing, steep, volume, density)
            other = fields.pressure[j] + weight_below * fields.z[j] * beside
            push = pair_terms.pressure(own, other, steep, volume, lightness)
            drag = pair_terms.shear_viscosity(distance2, 1.0 / (distance2 + softening), steep, volume, 2.0 * viscosity)
            crowd = steep * volume * pair_terms.crowding(peak * shape(law.kernel, line, q))
            ax, ay, az = ax + push * dx + drag * du, ay + push * dy + drag * dv, az + push * dz + drag * dw
            cx, cy, cz = cx + crowd * dx, cy + crowd * dy, cz + crowd * dz
    return rate, ax, ay, az, cx, cy, cz


@summed
def drift_of(i, fluids, neighbours, fields, law):
    """Return the velocity (x, y, z) that XSPH adds when it moves a liquid particle, three scalars [m/s].

    It smooths the motion towards the mean velocity of the neighbours; momentum does not change.

    Args:
        i: Number of the particle, integer.
        fluids: Number of liquid particles, integer.
        neighbours: Numbers of its neighbours, liquid ones first, shape (k,).
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        law: ``Law``: constants of the particles, such as kernel, smoothing length and the factor of XSPH.
    """
    x, y, z, u, v, w = fields.x[i], fields.y[i], fields.z[i], fields.u[i], fields.v[i], fields.w[i]
    periods = periods_of(law)
    inverse = 1.0 / law.length
    fu = fv = fw = 0.0
    for image in range(1 + (law.mirror if z < 2.0 * law.length else 0)):
        side = 1.0 - 2.0 * image
        for n in range(liquid_among(neighbours, fluids)):
            j = uint32(neighbours[n])
            dx, dy, dz = apart((x, y, z), j, side, fields, periods)
            level = law.norm * shape(law.kernel, law.dimension == 1, sqrt(dx * dx + dy * dy + dz * dz) * inverse)
            weight = law.xsph * pair_terms.xsph(level, fields.mass[j], fields.density[i], fields.density[j])
            fu += weight * (fields.u[j] - u)
            fv += weight * (fields.v[j] - v)
            fw += weight * (side * fields.w[j] - w)
    return fu, fv, fw


@compiled
def solved(moments, sums, dimension):
    """Solve ``moments gradient = sums`` for a gradient, three scalars (x, y, z); zero if it is not resolved.

    In a plane only the x and z components are solved; y is zero.

    Args:
        moments: Entries xx, yy, zz, xy, yz and xz of a dimensionless symmetric matrix, about the identity inside the
            liquid; a tuple of six scalars.
        sums: Right-hand side (x, y, z), a tuple of three scalars in the unit of the gradient.
        dimension: Dimension of the flow, integer: 1 (along x), 2 (x and z) or 3.
    """
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


@summed
def fitted_slope(i, neighbours, fields, law):
    """Return the density gradient at a particle by a linear least-squares fit, three scalars (x, y, z) [kg/m^4].

    With the weights W V it solves the 4 x 4 system of Belytschko et al. (1998), with the first row eliminated. It is
    zero if the neighbours do not resolve it (Shepard interpolation).

    Args:
        i: Number of the particle, integer.
        neighbours: Numbers of its liquid neighbours, shape (k,).
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        law: ``Law``: constants of the particles, such as kernel, smoothing length, density and speed of sound.
    """
    x, y, z, density = fields.x[i], fields.y[i], fields.z[i], fields.density[i]
    periods, inverse = periods_of(law), 1.0 / law.length
    total = jumps = fx = fy = fz = bx = by = bz = xx = yy = zz = xy = yz = xz = 0.0
    near = 0
    for image in range(1 + (law.mirror if z < 2.0 * law.length else 0)):
        side = 1.0 - 2.0 * image
        for n in range(len(neighbours)):
            j = uint32(neighbours[n])
            dx, dy, dz = apart((x, y, z), j, side, fields, periods)
            level = shape(law.kernel, law.dimension == 1, sqrt(dx * dx + dy * dy + dz * dz) * inverse)
            weight, jump = level * fields.mass[j] / fields.density[j], fields.density[j] - density
            near += 1 if level > 0.0 else 0
            dx, dy, dz = -dx * inverse, -dy * inverse, -dz * inverse
            total, jumps = total + weight, jumps + weight * jump
            fx, fy, fz = fx + weight * dx, fy + weight * dy, fz + weight * dz
            bx, by, bz = bx + weight * jump * dx, by + weight * jump * dy, bz + weight * jump * dz
            xx, yy, zz = xx + weight * dx * dx, yy + weight * dy * dy, zz + weight * dz * dz
            xy, yz, xz = xy + weight * dx * dy, yz + weight * dy * dz, xz + weight * dx * dz
    trace = (xx + yy + zz) / law.dimension
    if near <= FEWEST_NEIGHBOURS or trace <= 0.0:
        return 0.0, 0.0, 0.0
    mean = jumps / total
    bx, by, bz = (bx - mean * fx) / trace, (by - mean * fy) / trace, (bz - mean * fz) / trace
    xx, yy, zz = (xx - fx * fx / total) / trace, (yy - fy * fy / total) / trace, (zz - fz * fz / total) / trace
    xy, yz, xz = (xy - fx * fy / total) / trace, (yz - fy * fz / total) / trace, (xz - fx * fz / total) / trace
    if condition_of((xx, yy, zz, xy, yz, xz), law.dimension) > LARGEST_CONDITION:
        return 0.0, 0.0, 0.0
    sx, sy, sz = solved((xx, yy, zz, xy, yz, xz), (bx, by, bz), law.dimension)
    return sx * inverse, sy * inverse, sz * inverse


@compiled
def condition_of(moments, dimension):
    """Return an upper bound of the condition number of a symmetric 3 x 3 matrix, a scalar; infinite if it is singular.

    The largest eigenvalue is at most the trace, and the middle one at most half of it.

    Args:
        moments: Entries xx, yy, zz, xy, yz and xz of the matrix, a tuple of six scalars.
        dimension: Dimension of the flow, integer: 1 for xx only, 2 for x and z, 3 for the whole matrix.
    """
    xx, yy, zz, xy, yz, xz = moments
    if dimension == 1:
        return 1.0 if xx > 0.0 else inf
    if dimension == 2:
        determinant = xx * zz - xz * xz
        return (xx + zz) ** 2 / determinant if determinant > 0.0 else inf
    determinant = xx * (yy * zz - yz * yz) + xy * (xz * yz - xy * zz) + xz * (xy * yz - xz * yy)
    return 0.25 * (xx + yy + zz) ** 3 / determinant if determinant > 0.0 else inf


@summed
def wall_values(i, fluids, neighbours, fields, law):
    """Return pressure, velocity and weight of a wall particle from the liquid near it.

    The pressure is extrapolated from the liquid with its hydrostatic part (Adami et al. 2012). With a free surface that
    is not tracked it is not negative. The velocity is twice the wall's minus the mean of the liquid, which gives the
    wall's velocity at its face. The weight is the liquid within the kernel over ``Fields.wall_room``, at most 1.

    Args:
        i: Number of the wall particle among all particles, integer.
        fluids: Number of liquid particles, integer; the first wall particle has this number.
        neighbours: Numbers of its neighbours, liquid ones first, shape (k,).
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        law: ``Law``: constants of the particles, such as kernel, smoothing length, density and speed of sound.

    Returns:
        Tuple of five scalars: pressure [Pa], velocity (x, y, z) [m/s], weight from 0 to 1.
    """
    x, y, z = fields.x[i], fields.y[i], fields.z[i]
    line = law.dimension == 1
    inverse = 1.0 / law.length
    total = liquid = pressure = u = v = w = 0.0
    periods = periods_of(law)
    for image in range(1 + (law.mirror if z < 2.0 * law.length else 0)):
        side = 1.0 - 2.0 * image
        hold = side if law.no_slip else 1.0
        for n in range(liquid_among(neighbours, fluids)):
            j = uint32(neighbours[n])
            dx, dy, dz = apart((x, y, z), j, side, fields, periods)
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
    return positive(pressure) if pulls_not(law) else pressure, u, v, w, share
