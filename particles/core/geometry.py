"""Geometry of one solder joint, two wetted discs with a gap between them, and the resolution of its particle cloud."""

from dataclasses import dataclass
from math import ceil, pi, sqrt

# Largest relative change of a joint's width by offset and tilt for which the coaxial joint is a reference to 1 %.
LARGEST_WIDTH_CHANGE = 2e-3


@dataclass(frozen=True, slots=True)
class JointGeometry:
    """Two wetted discs: the board's at z = 0 around the z axis, the package's above it.

    Attributes:
        gap: Height of the centre of the package's disc [m].
        radius_board: Radius of the wetted disc on the board [m].
        radius_package: Radius of the wetted disc on the package [m].
        offset: Coordinates x and y of the centre of the package's disc [m].
        tilt: Rotations of the package's disc about the x and the y axis through its centre [rad].
    """

    gap: float
    radius_board: float
    radius_package: float
    offset: tuple[float, float] = (0.0, 0.0)
    tilt: tuple[float, float] = (0.0, 0.0)

    @property
    def is_coaxial(self) -> bool:
        """Whether both discs are horizontal and centred on the z axis, so that the joint is a body of revolution."""
        return self.offset == self.tilt == (0.0, 0.0)


def joint_counts(geometry: JointGeometry, volume: float, spacing: float) -> tuple[int, int]:
    """Return the number of concentric rings in a layer of a joint's cloud and the number of layers, in this order.

    Layers are sqrt(3)/2 spacings apart, so that the surface triangles are nearly equilateral.

    Args:
        geometry: Gap between the plates and radii of the wetted discs.
        volume: Solder volume [m^3].
        spacing: Particle spacing [m].
    """
    mean_radius = sqrt(volume / (pi * geometry.gap))
    rings = max(3, ceil(mean_radius / spacing))
    layers = max(4, 1 + round(geometry.gap / (0.5 * sqrt(3.0) * spacing)))
    return rings, layers
