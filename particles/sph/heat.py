"""Heat in particles: conduction among all of them and to the plate, and the enthalpy that says which are frozen.

The enthalpy e [J/kg] counts from solid at the melting point: T = T_m + e / c below it, T_m while the latent heat is
given off, T_m + (e - L) / c above (Voller & Prakash 1987). Conduction is that of Cleary & Monaghan 1999: a pair
exchanges heat, so that it is kept to rounding. The plate z = 0 has images of the particles beside it, with the
temperature that makes its own in the middle. At a free surface no heat is lost.
"""

from dataclasses import dataclass, field
from math import sqrt

import numpy as np
from numba import njit, prange, uint32
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.parameters.flows import DIFFUSIVE
from reflowshock.particles.parameters.freezing import Freezing
from reflowshock.particles.sph import pair_terms
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.particle_rates import apart, constants_of, periods_of, summed
from reflowshock.particles.sph.smoothing import slope
from reflowshock.particles.sph.threads import Rows

# Of the latent heat: with less of it a particle is solid, so that the front is in its middle.
FROZEN = 0.5


@summed
def warming_of(i, neighbours, fields, temperatures, law):
    """Return what conduction tells a particle: the Laplacian of temperature over the density [K m/kg].

    Args:
        i: the particle.
        neighbours: its row; it is in it, for its image.
        fields: `Fields`.
        temperatures: of all particles, and of their images `(2, n)` [K].
        law: `Law`.
    """
    x, y, z, own = fields.x[i], fields.y[i], fields.z[i], temperatures[0, i]
    periods, (line, inverse, scale, softening, _) = periods_of(law), constants_of(law)
    result = 0.0
    for image in range(1 + (law.mirror if z < 2.0 * law.length else 0)):
        side = 1.0 - 2.0 * image
        for n in range(len(neighbours)):
            j = uint32(neighbours[n])
            dx, dy, dz = apart((x, y, z), j, side, fields, periods)
            distance2 = dx * dx + dy * dy + dz * dz
            steep = scale * slope(law.kernel, line, sqrt(distance2) * inverse)
            volume = fields.mass[j] / fields.density[j]
            drop = own - temperatures[image, j]
            result += pair_terms.shear_viscosity(distance2, 1.0 / (distance2 + softening), steep, volume, 2.0) * drop
    return result / fields.density[i]


@njit(cache=True, parallel=True, error_model="numpy")
def _find_warming(lists, fields, temperatures, law, found):
    rows, counts = lists
    for k in prange(found.shape[0]):
        i = np.uint64(k)
        found[i] = warming_of(i, rows[i, : counts[i]], fields, temperatures, law)


@dataclass(slots=True)
class Heat:
    """Heat of n particles.

    Attributes:
        freezing: what freezes.
        law: of the particles.
        enthalpy: `(n,)` over that of solid at the melting point [J/kg].
        rows: neighbours of all of them.
    """

    freezing: Freezing
    law: Law
    enthalpy: Floats
    rows: Rows = field(init=False)

    def __post_init__(self) -> None:
        self.rows = Rows(self.law, len(self.enthalpy))

    @property
    def longest_step(self) -> float:
        """The largest stable time step of conduction [s]."""
        return DIFFUSIVE * self.law.length**2 / self.freezing.diffusivity(self.law.rest_density)

    @property
    def temperature(self) -> Floats:
        """Of the particles `(n,)` [K]."""
        given = self.freezing
        below, above = np.minimum(self.enthalpy, 0.0), np.maximum(self.enthalpy - given.latent_heat, 0.0)
        return given.melting_point + (below + above) / given.heat_capacity

    @property
    def is_frozen(self) -> NDArray[np.bool_]:
        """Which particles are solid `(n,)`."""
        return self.enthalpy < FROZEN * self.freezing.latent_heat

    def conduct(self, fields: Fields, time_step: float) -> None:
        """Let heat flow among particles and to the plate over a time step [s]."""
        self.rows.update(fields[:3])
        found, own = np.empty(len(self.enthalpy)), self.temperature
        temperatures = np.stack((own, 2.0 * self.freezing.substrate_temperature - own))
        _find_warming(self.rows.lists, fields, temperatures, self.law, found)
        self.enthalpy += time_step * self.freezing.conductivity * found


def enthalpy_at(freezing: Freezing, temperature: float) -> float:
    """Return the enthalpy [J/kg] of solid below the melting point, of liquid above and at it [K]."""
    warmer = freezing.heat_capacity * (temperature - freezing.melting_point)
    return warmer if warmer < 0.0 else freezing.latent_heat + warmer
