"""Motion of plates: along a prescribed path, or floating on the solder under a load.

A twist is the velocity of the origin of a plate and its angular velocity, shape (6,) [m/s, rad/s].
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.plate import Plate

LIFT = np.eye(6)[2:3]
SHIFT = np.eye(6)[:2]
TURN = np.eye(6)[3:5]


class PlateMotion(Protocol):
    """Motion of one plate: a prescribed twist and free directions."""

    @property
    def wall(self) -> int:
        """Index of the plate."""

    @property
    def directions(self) -> Floats:
        """Twists in which the plate moves freely, shape (k, 6)."""

    @property
    def load(self) -> Floats:
        """External force at the origin of the plate, shape (3,) [N]."""

    def prescribed_twist(self, plate: Plate, time_step: float) -> Floats:
        """Return the prescribed twist over the next time step [s], shape (6,) [m/s, rad/s]."""

    def after_split(self, wall: int) -> "PlateMotion | None":
        """Return the motion after the body has split, with a new index of the plate; None if the plate stops."""


@dataclass(frozen=True, slots=True, eq=False)
class Travel:
    """Plate that moves straight to a target at constant speed.

    Attributes:
        wall: Index of the plate.
        target: Final position of the plate.
        speed: Speed of the origin, or of a rotating point at the distance ``lever`` [m/s].
        lever: Length that converts rotations to distances, for example the pad radius [m].
    """

    wall: int
    target: Plate
    speed: float
    lever: float

    @property
    def directions(self) -> Floats:
        """Free twists: none, shape (0, 6)."""
        return np.zeros((0, 6))

    @property
    def load(self) -> Floats:
        """External force: zero, shape (3,) [N]."""
        return np.zeros(3)

    def prescribed_twist(self, plate: Plate, time_step: float) -> Floats:
        """Return the twist towards the target, shape (6,) [m/s, rad/s]."""
        return plate.motion_to(self.target) / max(time_step, self.duration(plate))

    def after_split(self, wall: int) -> "Travel":
        """Return the same motion with a new index of the plate: the plate carries its drop to the target."""
        return replace(self, wall=wall)

    def duration(self, plate: Plate) -> float:
        """Return the time to reach the target [s]."""
        path = plate.motion_to(self.target) * np.repeat((1.0, self.lever), 3)
        return float(np.linalg.norm(path)) / self.speed


@dataclass(frozen=True, slots=True, eq=False)
class Floating:
    """Floating plate, moved by the force of the solder and a load.

    Attributes:
        wall: Index of the plate.
        directions: Free twists, such as LIFT, SHIFT and TURN stacked, shape (k, 6).
        load: Force at the origin, for example a share of the package's weight, shape (3,) [N].
    """

    wall: int
    directions: Floats
    load: Floats

    def prescribed_twist(self, _plate: Plate, _time_step: float) -> Floats:
        """Return the prescribed twist, which is zero, shape (6,) [m/s, rad/s]."""
        return np.zeros(6)

    def after_split(self, _wall: int) -> None:
        """Return None: the plate stops, since no solder carries it."""
        return
