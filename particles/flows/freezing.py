"""Freezing of liquid on a cold plate: parameters (SI) and Neumann's exact growth of the frozen layer."""

from math import erf, erfc, exp, inf, pi, sqrt
from typing import Annotated

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

Temperature = Annotated[float, Quantity("degC")]
HALVINGS = 60


class Freezing(Parameters):
    """Liquid that freezes on a cold plate; a particle becomes immobile once it has lost half of its latent heat.

    Drops land with ``temperature``. The plate stays at ``substrate_temperature``; for a poorly conducting plate, use
    the contact temperature, which lies between the two. Liquid and solid have equal conductivity and heat capacity.
    Heat loss to the air and remelting are neglected.
    """

    melting_point: Temperature = Field(gt=0)
    substrate_temperature: Temperature = Field(gt=0)
    temperature: Temperature = Field(gt=0)
    latent_heat: Annotated[float, Quantity("J/kg")] = Field(gt=0)
    heat_capacity: Annotated[float, Quantity("J/kg/K")] = Field(gt=0)
    conductivity: Annotated[float, Quantity("W/m/K")] = Field(gt=0)

    def diffusivity(self, density: float) -> float:
        """Return the thermal diffusivity k / (rho c) [m^2/s] at a density [kg/m^3]."""
        return self.conductivity / (density * self.heat_capacity)

    @property
    def stefan(self) -> float:
        """Stefan number c (T_m - T_plate) / L."""
        return self.heat_capacity * (self.melting_point - self.substrate_temperature) / self.latent_heat

    @property
    def growth(self) -> float:
        """Coefficient lambda of the frozen layer, 2 lambda sqrt(a t) thick below deep liquid; 0 if none grows.

        Neumann's solution, with the thermal diffusivity a: St / (exp(l^2) erf l) = sqrt(pi) l + S / (exp(l^2) erfc l),
        where S = c (T - T_m) / L of the liquid.
        """
        excess = self.heat_capacity * (self.temperature - self.melting_point) / self.latent_heat
        low, high = 0.0, 5.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            decay = exp(-(middle**2))
            grows = self.stefan * decay / erf(middle) > sqrt(pi) * middle + excess * decay / erfc(middle)
            low, high = (middle, high) if grows else (low, middle)
        return low if self.stefan > 0.0 else 0.0

    def time_for(self, thickness: float, density: float) -> float:
        """Return the time in which a layer of a thickness [m] freezes below deep liquid [s]; inf if none freezes."""
        growth = self.growth
        return thickness**2 / (4.0 * growth**2 * self.diffusivity(density)) if growth else inf
