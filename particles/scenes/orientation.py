"""Joints that are alike but for a turn about z and a mirror image: one in canonical orientation stands for all.

Canonical is a joint whose package rises towards +x and is offset to y >= 0; untilted, it is offset towards +x.

The width of a joint that leans is compared with the coaxial joint of its gap; the difference is of second order, within
0.1 (offset / a + 2 tilt)^2.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2, hypot

import numpy as np

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.steps.shape import JointShape, Snapshot

NOTHING = 1e-12  # lengths below a picometre have no direction [m]
MIRROR = np.diag([1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class Orientation:
    """How a joint lies, seen from its canonical orientation: mirrored first (y to -y), then turned.

    Attributes:
        turn: about z [rad].
        mirror: whether it is the mirror image.
    """

    turn: float = 0.0
    mirror: bool = False

    @property
    def matrix(self) -> Floats:
        """Matrix `(3, 3)` that takes vectors of the canonical orientation to those of the joint."""
        cosine, sine = np.cos(self.turn), np.sin(self.turn)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        return turn @ MIRROR if self.mirror else turn

    def vectors(self, canonical: Floats) -> Floats:
        """Vectors `(k, 3)` of the canonical joint as those of this joint."""
        return canonical @ self.matrix.T

    def wrenches(self, canonical: Floats) -> Floats:
        """Rotate wrenches, shape (k, 6), from the canonical joint to this joint; moments are axial vectors."""
        sign = -1.0 if self.mirror else 1.0
        return np.hstack((self.vectors(canonical[:, :3]), sign * self.vectors(canonical[:, 3:])))


def canonical(geometry: JointGeometry) -> tuple[JointGeometry, Orientation]:
    """Return a joint in canonical orientation, and how the joint lies seen from it."""
    x, y = _nothing(geometry.offset, 1.0)
    turn_x, turn_y = _nothing(geometry.tilt, geometry.radius_package)
    steepness, distance = hypot(turn_x, turn_y), hypot(x, y)
    if steepness == distance == 0.0:
        return replace(geometry, offset=(0.0, 0.0), tilt=(0.0, 0.0)), Orientation()
    if steepness == 0.0:
        return replace(geometry, offset=(distance, 0.0), tilt=(0.0, 0.0)), Orientation(atan2(y, x))
    uphill = -turn_y / steepness, turn_x / steepness
    along, across = x * uphill[0] + y * uphill[1], y * uphill[0] - x * uphill[1]
    across = 0.0 if abs(across) < NOTHING else across
    orientation = Orientation(atan2(uphill[1], uphill[0]), bool(across < 0.0))
    return replace(geometry, offset=(along, abs(across)), tilt=(0.0, -steepness)), orientation


def _nothing(pair: tuple[float, float], lever: float) -> tuple[float, float]:
    """Return the pair, or zeros if it moves the lever [m] by less than a picometre."""
    return pair if hypot(*pair) * lever >= NOTHING else (0.0, 0.0)


def sizes(geometry: JointGeometry) -> Floats:
    """Return the lengths that identify a joint in canonical orientation, shape (6,) [m]."""
    discs = (geometry.gap, geometry.radius_board, geometry.radius_package)
    return np.array([*discs, *geometry.offset, geometry.tilt[1] * geometry.radius_package])


def oriented(shape: JointShape, orientation: Orientation) -> JointShape:
    """Transform the shape of a canonical joint to an orientation."""
    if orientation == Orientation():
        return shape

    def faces(indices: Sequence[Indices] | Indices) -> list[Indices]:
        return [np.ascontiguousarray(row[::-1] if orientation.mirror else row) for row in indices]

    def triangles(indices: Indices) -> Indices:
        return np.stack(faces(indices))

    return replace(
        shape,
        points=orientation.vectors(shape.points),
        velocity=orientation.vectors(shape.velocity),
        surface_points=orientation.vectors(shape.surface_points),
        triangles=triangles(shape.triangles),
        rings=tuple(faces(shape.rings)),
        snapshots=[
            Snapshot(snapshot.time, orientation.vectors(snapshot.points), triangles(snapshot.triangles))
            for snapshot in shape.snapshots
        ],
    )
