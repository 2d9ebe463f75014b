"""Freezing of liquid on a cold plate: its parameters in SI units, and the exact growth of a frozen layer (Neumann)."""

from math import erf, erfc, exp, inf, pi, sqrt
from typing import Annotated

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

Temperature = Annotated[float, Quantity("degC")]
HALVINGS = 60


class Freezing(Parameters):
    """Liquid that freezes on a cold plate: a particle stands still once half of its latent heat is gone.

    Drops land with `temperature`. The plate keeps its own where the liquid touches it: that of a contact with a plate
    that conducts badly lies between the two. Liquid and solid conduct and hold heat alike, and none is lost to the
    air. What has frozen does not melt again.
    """

    melting_point: Temperature = Field(gt=0)
    substrate_temperature: Temperature = Field(gt=0)
    temperature: Temperature = Field(gt=0)
    latent_heat: Annotated[float, Quantity("J/kg")] = Field(gt=0)
    heat_capacity: Annotated[float, Quantity("J/kg/K")] = Field(gt=0)
    conductivity: Annotated[float, Quantity("W/m/K")] = Field(gt=0)

    def diffusivity(self, density: float) -> float:
        """Of heat, k / (rho c) [m^2/s]."""
        return self.conductivity / (density * self.heat_capacity)

    @property
    def stefan(self) -> float:
        """Stefan number c (T_m - T_plate) / L."""
        return self.heat_capacity * (self.melting_point - self.substrate_temperature) / self.latent_heat

    @property
    def growth(self) -> float:
        """Lambda of a frozen layer that is 2 lambda sqrt(a t) thick on a plate below much liquid; 0 where none grows.

        Neumann's solution, with a the diffusivity of heat: St / (exp(l^2) erf l) = sqrt(pi) l + S / (exp(l^2) erfc l),
        S = c (T - T_m) / L of the liquid.
        """
        excess = self.heat_capacity * (self.temperature - self.melting_point) / self.latent_heat
        low, high = 0.0, 5.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            steep = exp(-(middle**2))
            grows = self.stefan * steep / erf(middle) > sqrt(pi) * middle + excess * steep / erfc(middle)
            low, high = (middle, high) if grows else (low, middle)
        return low if self.stefan > 0.0 else 0.0

    def time_for(self, thickness: float, density: float) -> float:
        """Time in which a layer of a thickness [m] freezes below much liquid [s]; inf where none does."""
        growth = self.growth
        return thickness**2 / (4.0 * growth**2 * self.diffusivity(density)) if growth else inf
