"""Geometry of one joint: two coaxial wetted discs a gap apart. Plain data, no solver."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class JointGeometry:
    """Two wetted discs: the board's at z = 0, the package's at z = gap, both centred on the z axis.

    Attributes:
        gap: distance of the discs [m].
        radius_board: radius of the disc that solder wets on the board [m].
        radius_package: the same on the package [m].
    """

    gap: float
    radius_board: float
    radius_package: float

    @property
    def mean_area(self) -> float:
        """Mean cross-section of the frustum between the discs [m^2], over pi: (a^2 + ab + b^2) / 3."""
        a, b = self.radius_board, self.radius_package
        return (a * a + a * b + b * b) / 3.0
