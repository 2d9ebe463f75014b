"""Steps with time of one particle of the liquid, for threads and for CUDA: velocity Verlet, the mirror, the shift.

Half way through a step a particle has the velocity u + a dt / 2 and the density rho + rate dt / 2: ``middle`` `(7, n)`,
whose last three rows are what XSPH adds to the velocities that move particles [m/s].
"""

from reflowshock.particles.sph.particle_rates import compiled


@compiled
def predict(i, fields, rates, middle, time_step):
    """Move a particle over a time step [s]; velocity and density become what the last rates say of its end.

    Args:
        i: the particle.
        fields: `Fields`.
        rates: `(10, n)`, as `rates_of` returns them.
        middle: `(7, n)`, of which the first four are written.
        time_step: [s].
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
    """Give a particle that has moved its pressure; one behind the mirror becomes its image, whose motion is its own."""
    middle[2, i] *= reflect(i, fields, law)
    fields.pressure[i] = law.sound * law.sound * (fields.density[i] - law.rest_density)


@compiled
def reflect(i, fields, law):
    """Let a particle behind the mirror z = 0 change places with its image; return the sign of what is across it then.

    Without a branch: with one, threads would count references to all fields for every particle.
    """
    side = -1.0 if law.mirror and fields.z[i] < 0.0 else 1.0
    fields.z[i] *= side
    fields.w[i] *= side
    fields.slope_z[i] *= side
    return side


@compiled
def correct(i, fields, rates, middle, time_step):
    """End the time step [s] of a particle with the rates of its end, whose slope of density serves the next one."""
    half = 0.5 * time_step
    fields.u[i] = middle[0, i] + half * rates[1, i]
    fields.v[i] = middle[1, i] + half * rates[2, i]
    fields.w[i] = middle[2, i] + half * rates[3, i]
    fields.density[i] = middle[3, i] + half * rates[0, i]
    take_slope(i, fields, rates)


@compiled
def take_slope(i, fields, rates):
    """Keep the renormalised gradient of a particle's density."""
    fields.slope_x[i], fields.slope_y[i], fields.slope_z[i] = rates[4, i], rates[5, i], rates[6, i]


@compiled
def shift(i, fields, rates, factor, law):
    """Move a particle down the gradient of concentration times a factor [m^2] (Sun et al. 2017)."""
    fields.x[i] -= factor * rates[7, i]
    fields.y[i] -= factor * rates[8, i]
    fields.z[i] -= factor * rates[9, i]
    reflect(i, fields, law)


@compiled
def speed2_of(i, fields):
    """Return the square of a particle's speed [m^2/s^2]."""
    return fields.u[i] * fields.u[i] + fields.v[i] * fields.v[i] + fields.w[i] * fields.w[i]


@compiled
def cover(k, i, fields, found, law):
    """Give the k-th particle of walls, i of all, what liquid beside it says; ``found`` as `wall_values` returns it."""
    pressure, u, v, w, share = found
    fields.pressure[i], fields.u[i], fields.v[i], fields.w[i], fields.wall_share[k] = pressure, u, v, w, share
    fields.density[i] = law.rest_density + pressure / (law.sound * law.sound)
