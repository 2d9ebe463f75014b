"""Start-up of plane Poiseuille flow between two plates under a body force (Morris et al. 1997)."""

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
    """Liquid between two plates, periodic along them, accelerated from rest by a body force.

    The speed is the steady speed on the centre line. The duration is in units of w^2 / nu, the viscous time.
    """

    width: Annotated[float, Quantity("mm")] = Field(gt=0)
    speed: Annotated[float, Quantity("m/s")] = Field(gt=0)
    duration: float = Field(1.0, gt=0, le=10)

    @property
    def length(self) -> float:
        """Width of the channel [m]."""
        return self.width

    @property
    def fastest(self) -> float:
        """Steady speed on the centre line [m/s]."""
        return self.speed

    @property
    def force(self) -> float:
        """Body force per unit mass along the channel [m/s^2]."""
        if self.rheology is not None:
            rate = self.rate_at_wall
            return 2.0 * self.rheology.viscosity(rate, self.viscosity) * rate / (self.density * self.width)
        return 8.0 * self.viscosity * self.speed / (self.density * self.width**2)

    @property
    def rate_at_wall(self) -> float:
        """Shear rate at the plates in steady flow with a rheology [1/s]."""
        assert self.rheology is not None
        return rate_at_wall(self.rheology, self.viscosity, self.speed, self.width)

    @property
    def columns(self) -> int:
        """Number of particles along one period of the channel."""
        return max(10, self.numerics.particles_across // 2)

    @property
    def particles(self) -> int:
        """Number of liquid particles."""
        return self.columns * self.numerics.particles_across

    @property
    def until(self) -> float:
        """Duration of the flow [s]."""
        return self.duration * self.density * self.width**2 / self.viscosity


def channel_points(scene: Poiseuille) -> Floats:
    """Return the initial positions of the liquid particles, rows x, y, z of shape (3, n) [m].

    Args:
        scene: Width and length of the channel, and particle spacing; the lattice lies in the plane y = 0.
    """
    return lattice(np.arange(scene.columns), np.arange(scene.numerics.particles_across), scene.spacing)


def plate_points(scene: Poiseuille, layers: int) -> Floats:
    """Return the positions of the wall particles of both plates, rows x, y, z of shape (3, m) [m].

    Args:
        scene: Parameters of the channel flow: width, speed, duration, liquid and numerics.
        layers: Number of particle layers in each plate.
    """
    across, layer = scene.numerics.particles_across, np.arange(layers)
    return lattice(np.arange(scene.columns), np.concatenate((-1 - layer, across + layer)), scene.spacing)


def exact_speeds(height: Floats, time: float, scene: Poiseuille) -> Floats:
    """Return the exact speed profile of the channel, shape (n,) [m/s].

    Args:
        height: Heights above the lower plate, shape (n,) [m].
        time: Time since the start [s]; ignored with a rheology, where the steady profile is returned.
        scene: Parameters of the channel flow: width, speed, duration, liquid and numerics.
    """
    if scene.rheology is None:
        return exact.starting_channel(height, time, scene.width, scene.viscosity / scene.density, scene.force)
    law = scene.rheology
    return exact.steady_channel(
        height, scene.width, scene.rate_at_wall, lambda rate: law.viscosity(rate, scene.viscosity)
    )
