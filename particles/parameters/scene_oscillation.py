"""Scene of a free drop that swings. Its parameters in SI floats."""

from math import pi
from typing import Annotated

from pydantic import Field

from reflowshock.particles.parameters.scenes import Liquid
from reflowshock.particles.parameters.solder import Parameters, Solder, SolderNumerics
from reflowshock.particles.reference.rayleigh import rayleigh_frequency


class Oscillation(Parameters):
    """A free drop that swings in its second mode: it starts as a ball, with the velocity of that mode.

    The amplitude is in radii, the duration in Rayleigh's periods.
    """

    volume: Annotated[float, "mm^3"] = Field(gt=0)
    amplitude: float = Field(0.1, gt=0, le=0.3)
    periods: float = Field(2.0, ge=1, le=50)
    particles_per_radius: int = Field(4, ge=2, le=20)
    steps_per_period: int = Field(100, ge=16)

    @property
    def radius(self) -> float:
        """Radius of the ball [m]."""
        return (0.75 * self.volume / pi) ** (1.0 / 3.0)

    @property
    def particles(self) -> int:
        """Number of particles: 10 k^2 + 2 on shell k, one at the centre."""
        return 1 + sum(10 * shell**2 + 2 for shell in range(1, self.particles_per_radius + 1))

    def resolve(self, liquid: Liquid) -> Solder:
        """Return the drop's liquid."""
        numerics = SolderNumerics(spacing=self.radius / self.particles_per_radius)
        return Solder(volume=self.volume, numerics=numerics, **liquid.properties)


def rayleigh_period(scene: Oscillation, solder: Solder) -> float:
    """Period of the second mode at small amplitude and viscosity [s]."""
    return 2.0 * pi / rayleigh_frequency(2, scene.radius, solder.density, solder.surface_tension)
