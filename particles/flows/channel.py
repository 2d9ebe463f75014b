"""Scene of a channel: liquid between two plates is set in motion by a body force (Morris et al. 1997)."""

from typing import Annotated

import numpy as np
from pydantic import Field

from reflowshock.arrays import Floats
from reflowshock.particles.flows.flow import PlaneFlow
from reflowshock.particles.flows.lattice import lattice
from reflowshock.particles.flows.rheology import rate_at_wall
from reflowshock.particles.reference import viscous_flows as exact
from reflowshock.quantity import Quantity


class Poiseuille(PlaneFlow):
    """Liquid between two plates, periodic along them and at rest at the start, that a body force sets in motion.

    The speed is the steady speed in the middle; the duration is in w^2 / nu, in which the flow develops.
    """

    width: Annotated[float, Quantity("mm")] = Field(gt=0)
    speed: Annotated[float, Quantity("m/s")] = Field(gt=0)
    duration: float = Field(1.0, gt=0, le=10)

    @property
    def length(self) -> float:
        """The channel's width [m]."""
        return self.width

    @property
    def fastest(self) -> float:
        """Speed of the middle [m/s]."""
        return self.speed

    @property
    def force(self) -> float:
        """Acceleration along the channel [m/s^2]."""
        if self.rheology is not None:
            rate = self.rate_at_wall
            return 2.0 * self.rheology.viscosity(rate, self.viscosity) * rate / (self.density * self.width)
        return 8.0 * self.viscosity * self.speed / (self.density * self.width**2)

    @property
    def rate_at_wall(self) -> float:
        """Rate of shear at the plates in steady flow with a rheology [1/s]."""
        assert self.rheology is not None
        return rate_at_wall(self.rheology, self.viscosity, self.speed, self.width)

    @property
    def columns(self) -> int:
        """Particles along a period of the channel."""
        return max(10, self.numerics.particles_across // 2)

    @property
    def particles(self) -> int:
        """Particles of the liquid."""
        return self.columns * self.numerics.particles_across

    @property
    def until(self) -> float:
        """Duration of the flow [s]."""
        return self.duration * self.density * self.width**2 / self.viscosity


def channel_points(scene: Poiseuille) -> Floats:
    """Return the particles of the liquid at the start, shape (3, n) [m]."""
    return lattice(np.arange(scene.columns), np.arange(scene.numerics.particles_across), scene.spacing)


def plate_points(scene: Poiseuille, layers: int) -> Floats:
    """Return the wall particles of both plates, shape (3, m) [m].

    Args:
        scene: Channel.
        layers: Number of particles across a plate.
    """
    across, layer = scene.numerics.particles_across, np.arange(layers)
    return lattice(np.arange(scene.columns), np.concatenate((-1 - layer, across + layer)), scene.spacing)


def exact_speeds(height: Floats, time: float, scene: Poiseuille) -> Floats:
    """Return the exact speeds [m/s] at heights, shape (n,) [m], and a time [s]; with a rheology, of steady flow."""
    if scene.rheology is None:
        return exact.starting_channel(height, time, scene.width, scene.viscosity / scene.density, scene.force)
    law = scene.rheology
    return exact.steady_channel(
        height, scene.width, scene.rate_at_wall, lambda rate: law.viscosity(rate, scene.viscosity)
    )
