"""Enthalpy of a material that melts at one temperature (enthalpy method, Voller & Prakash 1987).

The specific enthalpy e [J/kg] is zero in the solid at the melting point T_m:

    T = T_m + min(e, 0) / c + max(e - L, 0) / c,

with the heat capacity c of solid and liquid [J/(kg K)] and the latent heat L [J/kg]. Numbers and arrays are accepted.
"""

from typing import Any

import numpy as np


def temperature(enthalpy: Any, melting_point: float, heat_capacity: float, latent_heat: float) -> Any:
    """Return the temperature of a material with a specific enthalpy [K].

    Args:
        enthalpy: Specific enthalpy, 0 for the solid at the melting point, a scalar or an array [J/kg].
        melting_point: Melting point [K].
        heat_capacity: Specific heat capacity of solid and liquid [J/(kg K)].
        latent_heat: Latent heat of melting [J/kg].

    Returns:
        Temperature, shaped as ``enthalpy``.
    """
    below, above = np.minimum(enthalpy, 0.0), np.maximum(enthalpy - latent_heat, 0.0)
    return melting_point + (below + above) / heat_capacity


def enthalpy(temperature: Any, melting_point: float, heat_capacity: float, latent_heat: float) -> Any:
    """Return the specific enthalpy at a temperature [J/kg], 0 for the solid at the melting point.

    The melting point counts as liquid.

    Args:
        temperature: Temperature, a scalar or an array [K].
        melting_point: Melting point [K].
        heat_capacity: Specific heat capacity of solid and liquid [J/(kg K)].
        latent_heat: Latent heat of melting [J/kg].

    Returns:
        Specific enthalpy, shaped as ``temperature``.
    """
    sensible = heat_capacity * (temperature - melting_point)
    return sensible + latent_heat * (sensible >= 0.0)
