"""Pairs of particles: distance vectors across periods and mirrors, constants, and the compilers of the kernels."""

from math import floor

from numba import njit

from reflowshock.particles.sph import pair_terms
from reflowshock.particles.sph.smoothing import shape

# Functions without arrays of their own need no reference counts, which cost a tenth of a step and made threads wait.
compiled = njit(cache=True, error_model="numpy", _nrt=False)
# Sums may be reordered by the compiler, so that several pairs are computed at a time; threads do not change the order.
# The order follows the names of the variables: renaming one changes the last bits of results.
summed = njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"}, _nrt=False)


@compiled
def periods_of(law):
    """Return the periods of a flow along x, y and z, as pairs (period [m], 1 / period [1/m]); (0, 0) if not periodic.

    Args:
        law: ``Law``: constants of the particles, of which the periods are read.
    """
    x, y, z = law.period_x, law.period_y, law.period_z
    return (x, 1.0 / x if x > 0.0 else 0.0), (y, 1.0 / y if y > 0.0 else 0.0), (z, 1.0 / z if z > 0.0 else 0.0)


@compiled
def constants_of(law):
    """Return five constants that all pairs of particles share, a tuple.

    Args:
        law: ``Law``: constants of the particles, of which kernel, smoothing length h, its normalisation sigma, spacing
            and dimension are read.

    Returns:
        Whether the flow has one dimension; 1 / h [1/m]; sigma / h^2, the factor of the kernel gradient; the softening
        0.01 h^2 of viscosity [m^2]; sigma over the kernel W at a distance of one spacing.
    """
    line, inverse = law.dimension == 1, 1.0 / law.length
    scale, softening = law.norm * inverse * inverse, pair_terms.SOFTENING * law.length * law.length
    return line, inverse, scale, softening, 1.0 / shape(law.kernel, line, law.spacing * inverse)


@compiled
def across(distance, period):
    """Return one component of the vector between two particles, for the nearest periodic image, a scalar [m].

    Args:
        distance: Difference of their coordinates, a scalar [m].
        period: Pair (period [m], 1 / period [1/m]) of this coordinate; (0, 0) if not periodic.
    """
    return distance - period[0] * floor(distance * period[1] + 0.5)


@compiled
def apart(place, j, side, fields, periods):
    """Return the vector (x, y, z) from a particle, or from its mirror image, to a position [m].

    Args:
        place: Position (x, y, z) [m].
        j: Number of the particle, integer.
        side: Scalar, 1 for the particle, -1 for its image behind the plane z = 0.
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        periods: Pairs (period [m], 1 / period [1/m]) for x, y and z, (0, 0) if not periodic.
    """
    dx = across(place[0] - fields.x[j], periods[0])
    dy = across(place[1] - fields.y[j], periods[1])
    return dx, dy, across(place[2] - side * fields.z[j], periods[2])


@compiled
def positive(value):
    """Return a scalar, or zero if it is negative or not a number.

    Numba 0.68 cannot compile ``max`` for a GPU.

    Args:
        value: Scalar of any unit.
    """
    return value if value > 0.0 else 0.0


@compiled
def liquid_among(neighbours, fluids):
    """Return the number of liquid particles in a row of neighbours, an integer; they come first.

    Args:
        neighbours: Particle numbers, liquid ones first, shape (k,).
        fluids: Number of liquid particles in all, integer; particles with smaller numbers are liquid.
    """
    first, last = 0, len(neighbours)
    while first < last:
        middle = (first + last) // 2
        if neighbours[middle] < fluids:
            first = middle + 1
        else:
            last = middle
    return first
