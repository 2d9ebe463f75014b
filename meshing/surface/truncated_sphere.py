"""Truncated sphere: equilibrium shape of a joint between coaxial discs that carries no axial load."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class TruncatedSphere:
    """Zone of a sphere on the plane z = 0, with the z axis as its axis.

    Attributes:
        height: Distance between both discs [m].
        radius_board: Radius of the lower disc [m].
        radius_package: Radius of the upper disc [m].
    """

    height: float
    radius_board: float
    radius_package: float

    @classmethod
    def of_volume(cls, volume: float, radius_board: float, radius_package: float) -> "TruncatedSphere":
        """Return the zone with a given volume [m^3] between two discs of given radii [m].

        V = pi H (3 a^2 + 3 b^2 + H^2) / 6 is a cubic equation for the height H with one real root, which follows from
        hyperbolic sines.
        """
        squares = radius_board**2 + radius_package**2
        turn = math.asinh(3.0 * volume / (math.pi * squares**1.5)) / 3.0
        return cls(2.0 * math.sqrt(squares) * math.sinh(turn), radius_board, radius_package)

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return (
            math.pi * self.height * (3.0 * self.radius_board**2 + 3.0 * self.radius_package**2 + self.height**2) / 6.0
        )

    @property
    def centre(self) -> float:
        """Height of the sphere's centre [m]; below the lower disc where the upper one is much smaller."""
        return (self.height**2 + self.radius_package**2 - self.radius_board**2) / (2.0 * self.height)

    @property
    def radius(self) -> float:
        """Radius of the sphere [m]."""
        return math.hypot(self.radius_board, self.centre)

    def signed_distance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the signed distance of points (n, 3) [m] to the free surface, negative inside, shape (n,) [m]."""
        axial, radial = points[:, 2], np.hypot(points[:, 0], points[:, 1])
        above = axial - self.centre
        from_centre = np.hypot(radial, above)
        foot = self.centre + self.radius * above / np.where(from_centre > 0.0, from_centre, 1.0)
        rims = np.minimum(
            np.hypot(radial - self.radius_board, axial),
            np.hypot(radial - self.radius_package, axial - self.height),
        )
        on_zone = (foot >= 0.0) & (foot <= self.height) & (from_centre > 0.0)
        inside = (from_centre < self.radius) & (axial >= 0.0) & (axial <= self.height)
        return np.where(on_zone, np.abs(from_centre - self.radius), rims) * np.where(inside, -1.0, 1.0)
