"""Loads of the shock: objects in a list, each a body acceleration in the frame of the drop table."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Load(Protocol):
    """A body force per mass."""

    def acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the acceleration ``(3,)`` [m/s^2] that acts on every kilogram at a time [s]."""


@dataclass(frozen=True, slots=True)
class HalfSineDrop:
    """Input-G at the mounting holes as direct acceleration input (JESD22-B111, package facing down).

    The package looks towards the ground, so the table's upward acceleration points along -z and the board, seen from
    the table, is pushed along +z. Displacements are relative to the table.

    Attributes:
        peak: Peak acceleration A [m/s^2].
        pulse: Duration tau of the half sine [s].
    """

    peak: float
    pulse: float

    def base(self, time: float) -> float:
        """Return the table's upward acceleration A sin(pi t / tau) [m/s^2], zero after the pulse."""
        return float(self.peak * np.sin(np.pi * time / self.pulse)) if 0.0 < time < self.pulse else 0.0

    def acceleration(self, time: float) -> NDArray[np.float64]:
        """Return the body acceleration ``(3,)`` [m/s^2]."""
        return np.array([0.0, 0.0, self.base(time)])

    def velocity_change(self, duration: float) -> float:
        """Return the integral of the pulse up to a time [m/s]; 2 A tau / pi for all of it."""
        angle = np.pi * min(duration, self.pulse) / self.pulse
        return float(self.peak * self.pulse / np.pi * (1.0 - np.cos(angle)))
