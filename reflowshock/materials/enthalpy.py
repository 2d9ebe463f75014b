"""Enthalpy of a material that melts at one temperature (enthalpy method, Voller & Prakash 1987).

The specific enthalpy e [J/kg] is zero in the solid at the melting point T_m:

    T = T_m + min(e, 0) / c + max(e - L, 0) / c,

with the heat capacity c of solid and liquid [J/(kg K)] and the latent heat L [J/kg]. Numbers and arrays are accepted.
"""

from typing import Any

import numpy as np


def temperature(enthalpy: Any, melting_point: float, heat_capacity: float, latent_heat: float) -> Any:
    """Return the temperature [K] of a material with a specific enthalpy [J/kg]."""
    below, above = np.minimum(enthalpy, 0.0), np.maximum(enthalpy - latent_heat, 0.0)
    return melting_point + (below + above) / heat_capacity


def enthalpy(temperature: Any, melting_point: float, heat_capacity: float, latent_heat: float) -> Any:
    """Return the specific enthalpy [J/kg] at a temperature [K]; the melting point counts as liquid."""
    sensible = heat_capacity * (temperature - melting_point)
    return sensible + latent_heat * (sensible >= 0.0)
