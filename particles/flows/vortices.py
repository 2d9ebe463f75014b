"""Decaying Taylor-Green vortices in a periodic box (Taylor & Green 1937)."""

from typing import Annotated

import numpy as np
from pydantic import Field

from reflowshock.arrays import Floats
from reflowshock.particles.flows.flow import PlaneFlow
from reflowshock.particles.flows.lattice import lattice
from reflowshock.quantity import Quantity


class TaylorGreen(PlaneFlow):
    """Four vortices in a periodic box that decay by viscosity.

    The speed is the largest initial speed; the duration is in units of side / speed.
    """

    side: Annotated[float, Quantity("mm")] = Field(gt=0)
    speed: Annotated[float, Quantity("m/s")] = Field(gt=0)
    duration: float = Field(1.0, gt=0, le=20)

    @property
    def length(self) -> float:
        """Side of the box [m]."""
        return self.side

    @property
    def fastest(self) -> float:
        """Largest initial speed [m/s]."""
        return self.speed

    @property
    def particles(self) -> int:
        """Number of liquid particles."""
        return self.numerics.particles_across**2

    @property
    def until(self) -> float:
        """Duration of the flow [s]."""
        return self.duration * self.side / self.speed


def box_points(scene: TaylorGreen) -> Floats:
    """Return the initial positions of the particles in the box, rows x, y, z of shape (3, n) [m].

    Args:
        scene: Side of the periodic box and particle spacing; the lattice lies in the plane y = 0.
    """
    indices = np.arange(scene.numerics.particles_across)
    return lattice(indices, indices, scene.spacing)
