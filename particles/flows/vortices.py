"""Scene of decaying vortices in a periodic box (Taylor & Green 1937)."""

from typing import Annotated

import numpy as np
from pydantic import Field

from reflowshock.arrays import Floats
from reflowshock.particles.flows.flow import PlaneFlow
from reflowshock.particles.flows.lattice import lattice
from reflowshock.quantity import Quantity


class TaylorGreen(PlaneFlow):
    """Four vortices in a periodic box that decay by viscosity.

    The duration is in side / speed, the speed the largest one at the start.
    """

    side: Annotated[float, Quantity("mm")] = Field(gt=0)
    speed: Annotated[float, Quantity("m/s")] = Field(gt=0)
    duration: float = Field(1.0, gt=0, le=20)

    @property
    def length(self) -> float:
        """The box's side [m]."""
        return self.side

    @property
    def fastest(self) -> float:
        """The largest speed at the start [m/s]."""
        return self.speed

    @property
    def particles(self) -> int:
        """Particles of the liquid."""
        return self.numerics.particles_across**2

    @property
    def until(self) -> float:
        """Duration of the flow [s]."""
        return self.duration * self.side / self.speed


def box_points(scene: TaylorGreen) -> Floats:
    """Return the particles of the box at the start, shape (3, n) [m]."""
    indices = np.arange(scene.numerics.particles_across)
    return lattice(indices, indices, scene.spacing)
