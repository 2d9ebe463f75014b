"""Rigid plates: the planes that bound a liquid body, with the centre of a pad, and how they are placed and moved."""

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
        centre: x and y in the frame of the plate [m].
        radius: of its edge [m]; infinite where it covers the whole plate.
        angle: contact angle on it [rad].
    """

    centre: tuple[float, float]
    radius: float
    angle: float

    def corners(self, spacing: float) -> float:
        """Vertices a spacing [m] apart around its edge, no whole number."""
        return 2.0 * np.pi * self.radius / spacing


@dataclass(frozen=True, slots=True, eq=False)
class Plate:
    """A rigid plate: solder mask with pads.

    Attributes:
        origin: `(3,)` centre of the pad [m].
        frame: `(3, 3)` orthonormal rows: two tangents and the normal, which is +z where the plate is horizontal.
        side: +1 if the normal points out of the liquid, as on the package, -1 if into it, as on the board.
        pads: the pads on it, where a scene has several; that of a single joint or drop is at the origin.
    """

    origin: Floats
    frame: Floats
    side: float = -1.0
    pads: tuple[Pad, ...] = ()

    @classmethod
    def horizontal(cls, height: float, centre: tuple[float, float] = (0.0, 0.0), side: float = -1.0) -> "Plate":
        """Place a plate at z = height."""
        return cls(np.array([*centre, height]), np.eye(3), side)

    @property
    def normal(self) -> Floats:
        """Unit normal `(3,)`."""
        return self.frame[2]

    def local(self, points: Floats) -> Floats:
        """Coordinates in the plate's frame of points `(k, 3)` [m]; the third is the height above the plate."""
        return (points - self.origin) @ self.frame.T

    def place(self, local: Floats) -> Floats:
        """Points `(k, 3)` [m] of coordinates in the plate's frame."""
        return self.origin + local @ self.frame

    def rigid_velocity(self, twist: Floats, points: Floats) -> Floats:
        """Velocity `(k, 3)` [m/s] that a twist of the plate gives to points.

        Args:
            twist: `(6,)` velocity of the origin [m/s] and angular velocity [rad/s].
            points: `(k, 3)` [m].
        """
        return twist[:3] + np.cross(twist[3:], points - self.origin)

    def moved(self, motion: Floats) -> "Plate":
        """This plate displaced by `motion[:3]` [m] and turned about its origin by the rotation vector `motion[3:]`."""
        turn = Rotation.from_rotvec(motion[3:]).as_matrix()
        return replace(self, origin=self.origin + motion[:3], frame=self.frame @ turn.T)

    def motion_to(self, other: "Plate") -> Floats:
        """Displacement and rotation vector `(6,)` with which `moved` leads to another plate."""
        turn = Rotation.from_matrix(other.frame.T @ self.frame).as_rotvec()
        return np.concatenate((other.origin - self.origin, turn))


def joint_plates(geometry: JointGeometry) -> tuple[Plate, Plate]:
    """Place the plates of a joint: the board's at z = 0, the package's with its offset and tilt."""
    package = Plate.horizontal(geometry.gap, geometry.offset, side=1.0)
    return Plate.horizontal(0.0), package.moved(np.array([0.0, 0.0, 0.0, *geometry.tilt, 0.0]))


def placed_geometry(geometry: JointGeometry, plates: Sequence[Plate]) -> JointGeometry:
    """The geometry of a joint whose plates have moved, seen from the board's plate."""
    board, package = plates
    x, y, gap = map(float, board.local(package.origin[None])[0])
    turn = Rotation.from_matrix(board.frame @ package.frame.T).as_rotvec()
    return replace(geometry, gap=gap, offset=(x, y), tilt=(float(turn[0]), float(turn[1])))


def slide(plates: Sequence[Plate], wall: NDArray[np.int8], field: Floats) -> Floats:
    """The part of a vector field `(k, 3)` along the plates; `wall (k,)` names the plate of a vector, -1 for none."""
    result = field.copy()
    for number, plate in enumerate(plates):
        on_plate = wall == number
        result[on_plate] -= np.outer(result[on_plate] @ plate.normal, plate.normal)
    return result
