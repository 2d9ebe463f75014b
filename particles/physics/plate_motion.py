"""How plates move: along a prescribed path, or freely under the solder and a load. A plate in no list rests."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.plate import Plate

LIFT = np.eye(6)[2:3]
SHIFT = np.eye(6)[:2]
TURN = np.eye(6)[3:5]


class PlateMotion(Protocol):
    """The motion of one plate: a given twist, and free ones. A twist is the velocity of the origin and a spin."""

    @property
    def wall(self) -> int:
        """Index of the plate."""

    @property
    def directions(self) -> Floats:
        """The twists with which the plate moves freely, `(k, 6)`."""

    @property
    def load(self) -> Floats:
        """Force on the plate besides the solder's, at its origin, `(3,)` [N]."""

    def given(self, plate: Plate, time_step: float) -> Floats:
        """Twist `(6,)` [m/s, rad/s] over the next time step [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Travel:
    """A plate that is moved to a target on the straight way, at a speed.

    Attributes:
        wall: index of the plate.
        target: where it stops.
        speed: of the origin, and of a point that a rotation turns on the lever [m/s].
        lever: for example the radius of the pad [m].
    """

    wall: int
    target: Plate
    speed: float
    lever: float

    @property
    def directions(self) -> Floats:
        """None."""
        return np.zeros((0, 6))

    @property
    def load(self) -> Floats:
        """None."""
        return np.zeros(3)

    def given(self, plate: Plate, time_step: float) -> Floats:
        """Twist towards the target, `(6,)`."""
        return plate.motion_to(self.target) / max(time_step, self.duration(plate))

    def duration(self, plate: Plate) -> float:
        """Time that the way to the target takes [s]."""
        way = plate.motion_to(self.target) * np.repeat((1.0, self.lever), 3)
        return float(np.linalg.norm(way)) / self.speed


@dataclass(frozen=True, slots=True, eq=False)
class Floating:
    """A plate that follows the solder's force and a load.

    Attributes:
        wall: index of the plate.
        directions: `(k, 6)` twists that are free, such as LIFT, SHIFT and TURN, stacked.
        load: `(3,)` force at its origin [N], for example a share of the package's weight.
    """

    wall: int
    directions: Floats
    load: Floats

    def given(self, _plate: Plate, _time_step: float) -> Floats:
        """None."""
        return np.zeros(6)
