"""Time integration of one particle, for threads and CUDA: velocity Verlet, mirror, particle shifting.

The array ``middle``, shape (7, n), has the velocity u + a dt / 2 and the density rho + rate dt / 2 in the middle of a
step; its last three rows are the velocities that XSPH adds when it moves particles [m/s].
"""

from reflowshock.particles.sph.particle_pairs import compiled


@compiled
def predict(i, fields, rates, middle, time_step):
    """Move a particle over a time step, and predict its velocity and density at the end of it from the last rates.

    Args:
        i: Number of the particle, integer.
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        rates: Rates, shape (10, n): density rate [kg/(m^3 s)], acceleration (3) [m/s^2], density gradient (3) [kg/m^4],
            concentration gradient (3) [1/m].
        middle: Work array, shape (7, n), changed in place: velocity (3) [m/s] and density [kg/m^3] in the middle of the
            step are written to its first four rows; its last three rows, the additional velocity of XSPH [m/s], are
            read.
        time_step: Time step, scalar [s].
    """
    half = 0.5 * time_step
    u, v, w = fields.u[i] + half * rates[1, i], fields.v[i] + half * rates[2, i], fields.w[i] + half * rates[3, i]
    fields.x[i] += time_step * (u + middle[4, i])
    fields.y[i] += time_step * (v + middle[5, i])
    fields.z[i] += time_step * (w + middle[6, i])
    middle[0, i], middle[1, i], middle[2, i] = u, v, w
    middle[3, i] = fields.density[i] + half * rates[0, i]
    fields.u[i] += time_step * rates[1, i]
    fields.v[i] += time_step * rates[2, i]
    fields.w[i] += time_step * rates[3, i]
    fields.density[i] += time_step * rates[0, i]


@compiled
def settle(i, fields, middle, law):
    """Reflect a particle that crossed the mirror and compute its pressure from its density.

    Args:
        i: Number of the particle, integer.
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles; the values of
            particle i change in place.
        middle: Work array, shape (7, n); its row 2, the velocity along z in the middle of the step [m/s], changes sign
            with the particle.
        law: ``Law``: constants of the particles, such as kernel, smoothing length, density and speed of sound.
    """
    middle[2, i] *= reflect(i, fields, law)
    fields.pressure[i] = law.sound * law.sound * (fields.density[i] - law.rest_density)


@compiled
def reflect(i, fields, law):
    """Replace a particle behind the mirror z = 0 by its image; return -1.0 if it was replaced, else 1.0.

    The code has no branch, since with a branch threads would count references to all fields for every particle.

    Args:
        i: Number of the particle, integer.
        fields: ``Fields``: arrays of the values of all particles; position, velocity and density gradient along z of
            particle i may change sign, in place.
        law: ``Law``: constants of the particles, of which ``mirror`` (0 or 1) is used; without a mirror nothing
            changes.
    """
    side = -1.0 if law.mirror and fields.z[i] < 0.0 else 1.0
    fields.z[i] *= side
    fields.w[i] *= side
    fields.slope_z[i] *= side
    return side


@compiled
def correct(i, fields, rates, middle, time_step):
    """Complete the time step of a particle: recompute velocity and density with the rates at its end.

    Args:
        i: Number of the particle, integer.
        fields: ``Fields``: arrays of the values of all particles; velocity, density and density gradient (taken from
            the rates) of particle i change in place.
        rates: Rates, shape (10, n): density rate [kg/(m^3 s)], acceleration (3) [m/s^2], density gradient (3) [kg/m^4],
            concentration gradient (3) [1/m].
        middle: Work array, shape (7, n); its first four rows, velocity (3) [m/s] and density [kg/m^3] in the middle of
            the step, are read.
        time_step: Time step, scalar [s].
    """
    half = 0.5 * time_step
    fields.u[i] = middle[0, i] + half * rates[1, i]
    fields.v[i] = middle[1, i] + half * rates[2, i]
    fields.w[i] = middle[2, i] + half * rates[3, i]
    fields.density[i] = middle[3, i] + half * rates[0, i]
    take_slope(i, fields, rates)


@compiled
def take_slope(i, fields, rates):
    """Store the density gradient of a particle for the next step.

    Args:
        i: Number of the particle, integer.
        fields: ``Fields``: arrays of the values of all particles; the density gradient of particle i is set, in place.
        rates: Rates, shape (10, n): density rate [kg/(m^3 s)], acceleration (3) [m/s^2], density gradient (3) [kg/m^4],
            concentration gradient (3) [1/m]; rows 4 to 6 are used.
    """
    fields.slope_x[i], fields.slope_y[i], fields.slope_z[i] = rates[4, i], rates[5, i], rates[6, i]


@compiled
def shift(i, fields, rates, factor, law):
    """Shift a particle against the concentration gradient (Sun et al. 2017), and reflect it at the mirror.

    Args:
        i: Number of the particle, integer.
        fields: ``Fields``: arrays of the values of all particles; the position of particle i changes in place.
        rates: Rates, shape (10, n): density rate [kg/(m^3 s)], acceleration (3) [m/s^2], density gradient (3) [kg/m^4],
            concentration gradient (3) [1/m]; rows 7 to 9 are used.
        factor: Factor of the gradient, a scalar [m^2].
        law: ``Law``: constants of the particles, such as kernel, smoothing length, density and speed of sound.
    """
    fields.x[i] -= factor * rates[7, i]
    fields.y[i] -= factor * rates[8, i]
    fields.z[i] -= factor * rates[9, i]
    reflect(i, fields, law)


@compiled
def speed2_of(i, fields):
    """Return the squared speed of a particle, a scalar [m^2/s^2].

    Args:
        i: Number of the particle, integer.
        fields: ``Fields``: arrays of the values of all particles, of which the velocities u, v, w are read.
    """
    return fields.u[i] * fields.u[i] + fields.v[i] * fields.v[i] + fields.w[i] * fields.w[i]


@compiled
def cover(k, i, fields, found, law):
    """Write pressure, velocity and weight of a wall particle to the fields; its density follows from its pressure.

    Args:
        k: Number of the wall particle among the wall particles, integer.
        i: Its number among all particles, integer.
        fields: ``Fields``: arrays of the values of all particles; those of the wall particle change in place.
        found: Pressure [Pa], velocity along x, y, z [m/s] and weight (0 to 1) of the particle, a tuple of five scalars.
        law: ``Law``: constants of the particles, such as kernel, smoothing length, density and speed of sound.
    """
    pressure, u, v, w, share = found
    fields.pressure[i], fields.u[i], fields.v[i], fields.w[i], fields.wall_share[k] = pressure, u, v, w, share
    fields.density[i] = law.rest_density + pressure / (law.sound * law.sound)
