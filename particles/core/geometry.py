"""Geometry of one joint: two wetted discs a gap apart, and the counts of its particle cloud. Plain data."""

from dataclasses import dataclass
from math import ceil, pi, sqrt

# What offset and tilt may change of a joint's width: above it the coaxial joint is no reference to judge it to 1 %.
LARGEST_WIDTH_CHANGE = 2e-3


@dataclass(frozen=True, slots=True)
class JointGeometry:
    """Two wetted discs: the board's at z = 0 around the z axis, the package's a gap above.

    Attributes:
        gap: height of the centre of the package's disc [m].
        radius_board: radius of the disc that solder wets on the board [m].
        radius_package: the same on the package [m].
        offset: x and y of the centre of the package's disc [m].
        tilt: rotation of the package about its disc's centre: turns about the x and the y axis [rad].
    """

    gap: float
    radius_board: float
    radius_package: float
    offset: tuple[float, float] = (0.0, 0.0)
    tilt: tuple[float, float] = (0.0, 0.0)

    @property
    def is_coaxial(self) -> bool:
        """Whether both discs are horizontal and centred on the z axis: the joint is a body of revolution."""
        return self.offset == self.tilt == (0.0, 0.0)


def joint_counts(geometry: JointGeometry, volume: float, spacing: float) -> tuple[int, int]:
    """Concentric rings in a layer and layers of a joint's cloud.

    Layers are sqrt(3)/2 spacings apart, so that the surface triangles are nearly equilateral.

    Args:
        geometry: gap and radii.
        volume: [m^3].
        spacing: particle spacing [m].
    """
    mean_radius = sqrt(volume / (pi * geometry.gap))
    rings = max(3, ceil(mean_radius / spacing))
    layers = max(4, 1 + round(geometry.gap / (0.5 * sqrt(3.0) * spacing)))
    return rings, layers
