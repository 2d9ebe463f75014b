"""Heat conduction between particles and to the plate z = 0, with freezing by the enthalpy method.

Conduction follows Cleary & Monaghan (1999): heat is exchanged between pairs, so its sum is conserved to rounding.
The plate acts through images of the particles near it: the mean temperature of a particle and its image is the plate
temperature. A free surface is adiabatic. ``reflowshock.materials.enthalpy`` relates enthalpy and temperature.
"""

from dataclasses import dataclass, field
from math import sqrt

import numpy as np
from numba import njit, prange, uint32
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.materials import enthalpy
from reflowshock.particles.flows.freezing import Freezing
from reflowshock.particles.flows.sph_numerics import DIFFUSIVE
from reflowshock.particles.sph import pair_terms
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.particle_pairs import apart, constants_of, periods_of, summed
from reflowshock.particles.sph.smoothing import slope
from reflowshock.particles.sph.threads import Rows

# Share of the latent heat below which a particle is solid: the front is then in the middle of the particle.
FROZEN = 0.5


@summed
def temperature_laplacian(i, neighbours, fields, temperatures, law):
    """Return the Laplacian of the temperature over the density at a particle, a scalar [K m/kg].

    Args:
        i: Number of the particle, integer.
        neighbours: Numbers of its neighbours, shape (k,), which include itself because of its image.
        fields: ``Fields``: arrays of position, velocity, density, pressure and mass of all particles, liquid first.
        temperatures: Temperatures of all particles, row 0, and of their mirror images, row 1, shape (2, n) [K].
        law: ``Law``: constants of the particles, such as kernel, smoothing length, density and speed of sound.
    """
    x, y, z, temperature = fields.x[i], fields.y[i], fields.z[i], temperatures[0, i]
    periods, (line, inverse, scale, softening, _) = periods_of(law), constants_of(law)
    result = 0.0
    for image in range(1 + (law.mirror if z < 2.0 * law.length else 0)):
        side = 1.0 - 2.0 * image
        for n in range(len(neighbours)):
            j = uint32(neighbours[n])
            dx, dy, dz = apart((x, y, z), j, side, fields, periods)
            distance2 = dx * dx + dy * dy + dz * dz
            gradient = scale * slope(law.kernel, line, sqrt(distance2) * inverse)
            volume = fields.mass[j] / fields.density[j]
            drop = temperature - temperatures[image, j]
            result += pair_terms.shear_viscosity(distance2, 1.0 / (distance2 + softening), gradient, volume, 2.0) * drop
    return result / fields.density[i]


@njit(cache=True, parallel=True, error_model="numpy")
def _find_laplacians(lists, fields, temperatures, law, laplacians):
    rows, counts = lists
    for k in prange(laplacians.shape[0]):
        i = np.uint64(k)
        laplacians[i] = temperature_laplacian(i, rows[i, : counts[i]], fields, temperatures, law)


@dataclass(slots=True)
class Heat:
    """Heat of n particles.

    Attributes:
        freezing: Thermal parameters of the liquid and the plate.
        law: Parameters of the pair interactions.
        enthalpy: Specific enthalpy of each particle, zero in the solid at the melting point, shape (n,) [J/kg].
        rows: Neighbours of all particles.
    """

    freezing: Freezing
    law: Law
    enthalpy: Floats
    rows: Rows = field(init=False)

    def __post_init__(self) -> None:
        self.rows = Rows(self.law, len(self.enthalpy))

    @property
    def longest_step(self) -> float:
        """Largest stable time step of conduction [s]."""
        return DIFFUSIVE * self.law.length**2 / self.freezing.diffusivity(self.law.rest_density)

    @property
    def temperature(self) -> Floats:
        """Temperature of each particle, shape (n,) [K]."""
        material = self.freezing
        return enthalpy.temperature(self.enthalpy, material.melting_point, material.heat_capacity, material.latent_heat)

    @property
    def is_frozen(self) -> NDArray[np.bool_]:
        """Whether each particle is solid, shape (n,)."""
        return self.enthalpy < FROZEN * self.freezing.latent_heat

    def conduct(self, fields: Fields, time_step: float) -> None:
        """Conduct heat between particles and to the plate over a time step [s]."""
        self.rows.update(fields[:3])
        laplacians, temperature = np.empty(len(self.enthalpy)), self.temperature
        temperatures = np.stack((temperature, 2.0 * self.freezing.substrate_temperature - temperature))
        _find_laplacians(self.rows.lists, fields, temperatures, self.law, laplacians)
        self.enthalpy += time_step * self.freezing.conductivity * laplacians


def enthalpy_at(freezing: Freezing, temperature: float) -> float:
    """Return the specific enthalpy of an ink at a temperature, 0 for the solid at the melting point [J/kg].

    Args:
        freezing: Melting point, latent heat and heat capacity of the ink.
        temperature: Temperature [K]; the melting point counts as liquid.
    """
    return float(enthalpy.enthalpy(temperature, freezing.melting_point, freezing.heat_capacity, freezing.latent_heat))
