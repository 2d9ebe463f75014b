"""Rigid plates, the planes that bound a liquid body: pads on them, local coordinates and rigid motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from reflowshock.arrays import Floats
from reflowshock.particles.core.geometry import JointGeometry


@dataclass(frozen=True, slots=True)
class Pad:
    """A round pad in the solder mask of a plate.

    Attributes:
        centre: Coordinates x and y of the centre in the frame of the plate [m].
        radius: Radius of the pad [m]; infinite if it covers the whole plate.
        angle: Contact angle on the pad [rad].
    """

    centre: tuple[float, float]
    radius: float
    angle: float

    def corners(self, spacing: float) -> float:
        """Return the circumference over a spacing [m]: the number of vertices around the edge, not rounded."""
        return 2.0 * np.pi * self.radius / spacing


@dataclass(frozen=True, slots=True, eq=False)
class Plate:
    """A rigid plate of solder mask with pads.

    Attributes:
        origin: Centre of the pad, shape (3,) [m].
        frame: Orthonormal rows, two tangents and the normal, which is +z for a horizontal plate, shape (3, 3).
        side: +1 if the normal points out of the liquid, as on the package, -1 if into it, as on the board.
        pads: Pads, if a scene has several; the pad of a single joint or drop is at the origin.
    """

    origin: Floats
    frame: Floats
    side: float = -1.0
    pads: tuple[Pad, ...] = ()

    @classmethod
    def horizontal(cls, height: float, centre: tuple[float, float] = (0.0, 0.0), side: float = -1.0) -> "Plate":
        """Create a horizontal plate at a height [m], with its pad centred at x, y [m]."""
        return cls(np.array([*centre, height]), np.eye(3), side)

    @property
    def normal(self) -> Floats:
        """Unit normal, shape (3,)."""
        return self.frame[2]

    def local(self, points: Floats) -> Floats:
        """Return points (k, 3) [m] in the plate's frame; the third coordinate is the height above the plate."""
        return (points - self.origin) @ self.frame.T

    def place(self, local: Floats) -> Floats:
        """Return points given in the plate's frame (k, 3) in global coordinates [m]; the inverse of ``local``."""
        return self.origin + local @ self.frame

    def rigid_velocity(self, twist: Floats, points: Floats) -> Floats:
        """Return the velocities of points that move with the plate, shape (k, 3) [m/s].

        Args:
            twist: Velocity of the origin and angular velocity, shape (6,) [m/s, rad/s].
            points: Points, shape (k, 3) [m].
        """
        return twist[:3] + np.cross(twist[3:], points - self.origin)

    def moved(self, motion: Floats) -> "Plate":
        """Return the plate displaced by ``motion[:3]`` [m] and rotated about its origin by ``motion[3:]`` [rad]."""
        rotation = Rotation.from_rotvec(motion[3:]).as_matrix()
        return replace(self, origin=self.origin + motion[:3], frame=self.frame @ rotation.T)

    def motion_to(self, other: "Plate") -> Floats:
        """Return the motion (6,) [m, rad] for which ``moved`` returns the other plate."""
        rotation = Rotation.from_matrix(other.frame.T @ self.frame).as_rotvec()
        return np.concatenate((other.origin - self.origin, rotation))


def joint_plates(geometry: JointGeometry) -> tuple[Plate, Plate]:
    """Return the board's plate at z = 0 and the package's plate at its gap, with its offset and tilt, in this order.

    Args:
        geometry: Gap, offset and tilt of the package's disc; the radii are ignored.
    """
    package = Plate.horizontal(geometry.gap, geometry.offset, side=1.0)
    return Plate.horizontal(0.0), package.moved(np.array([0.0, 0.0, 0.0, *geometry.tilt, 0.0]))


def placed_geometry(geometry: JointGeometry, plates: Sequence[Plate]) -> JointGeometry:
    """Return the geometry of a joint whose plates have moved, in the frame of the board's plate.

    Args:
        geometry: Geometry of the joint, whose radii are kept.
        plates: Present plates of board and package, in this order.

    Returns:
        Geometry with the present gap, offset and tilt.
    """
    board, package = plates
    x, y, gap = map(float, board.local(package.origin[None])[0])
    rotation = Rotation.from_matrix(board.frame @ package.frame.T).as_rotvec()
    return replace(geometry, gap=gap, offset=(x, y), tilt=(float(rotation[0]), float(rotation[1])))


def slide(plates: Sequence[Plate], wall: NDArray[np.int8], field: Floats) -> Floats:
    """Remove the normal component of vectors at particles on plates.

    Args:
        plates: Plates, e.g. of a body, numbered from 0.
        wall: Number of the plate of each vector, -1 for none, shape (k,).
        field: Vectors of any unit, shape (k, 3); not changed.

    Returns:
        Tangential vectors, shape (k, 3); vectors without a plate as they are.
    """
    result = field.copy()
    for number, plate in enumerate(plates):
        on_plate = wall == number
        result[on_plate] -= np.outer(result[on_plate] @ plate.normal, plate.normal)
    return result
