"""Canonical orientation of a joint: joints that differ by a rotation about z and a mirror image are computed once.

In the canonical orientation the package rises towards +x and is offset to y >= 0; without tilt, the offset is along +x.

The width of a leaning joint is compared with the coaxial joint of the same gap; the difference is of second order,
within 0.1 (offset / a + 2 tilt)^2.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2, hypot

import numpy as np

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.steps.shape import JointShape, Snapshot

SHORTEST = 1e-12  # shorter vectors have no direction [m]
MIRROR = np.diag([1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class Orientation:
    """Transformation from the canonical orientation to a joint: first a reflection (y to -y), then a rotation.

    Attributes:
        turn: Angle of rotation about z [rad].
        mirror: Whether the joint is a mirror image.
    """

    turn: float = 0.0
    mirror: bool = False

    @property
    def matrix(self) -> Floats:
        """Matrix that transforms vectors of the canonical joint to this joint, shape (3, 3)."""
        cosine, sine = np.cos(self.turn), np.sin(self.turn)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        return turn @ MIRROR if self.mirror else turn

    def vectors(self, canonical: Floats) -> Floats:
        """Transform vectors, shape (k, 3), from the canonical joint to this joint."""
        return canonical @ self.matrix.T

    def wrenches(self, canonical: Floats) -> Floats:
        """Rotate wrenches, shape (k, 6), from the canonical joint to this joint; moments are axial vectors."""
        sign = -1.0 if self.mirror else 1.0
        return np.hstack((self.vectors(canonical[:, :3]), sign * self.vectors(canonical[:, 3:])))


def canonical(geometry: JointGeometry) -> tuple[JointGeometry, Orientation]:
    """Return a joint in canonical orientation, and the transformation from it to the joint.

    The package is then tilted about the y axis only, or offset along +x without tilt; rotated and mirrored joints share
    one canonical joint, so that it is computed once.

    Args:
        geometry: Gap, radii, offset and tilt of the joint.

    Returns:
        Canonical geometry, and the reflection (y to -y) and rotation about z that lead from it to the joint.
    """
    x, y = _without_rounding(geometry.offset, 1.0)
    turn_x, turn_y = _without_rounding(geometry.tilt, geometry.radius_package)
    steepness, distance = hypot(turn_x, turn_y), hypot(x, y)
    if steepness == distance == 0.0:
        return replace(geometry, offset=(0.0, 0.0), tilt=(0.0, 0.0)), Orientation()
    if steepness == 0.0:
        return replace(geometry, offset=(distance, 0.0), tilt=(0.0, 0.0)), Orientation(atan2(y, x))
    uphill = -turn_y / steepness, turn_x / steepness
    along, across = x * uphill[0] + y * uphill[1], y * uphill[0] - x * uphill[1]
    across = 0.0 if abs(across) < SHORTEST else across
    orientation = Orientation(atan2(uphill[1], uphill[0]), bool(across < 0.0))
    return replace(geometry, offset=(along, abs(across)), tilt=(0.0, -steepness)), orientation


def _without_rounding(pair: tuple[float, float], lever: float) -> tuple[float, float]:
    """Return an offset or tilt, or zeros if it moves a point at the distance ``lever`` [m] by less than a picometre."""
    return pair if hypot(*pair) * lever >= SHORTEST else (0.0, 0.0)


def sizes(geometry: JointGeometry) -> Floats:
    """Return the lengths that identify a joint in canonical orientation, shape (6,) [m].

    They are the gap, the radii on board and package, the offset along x and y, and the rise of the pad's edge by the
    tilt.

    Args:
        geometry: Gap, radii, offset and tilt of a joint in canonical orientation.
    """
    discs = (geometry.gap, geometry.radius_board, geometry.radius_package)
    return np.array([*discs, *geometry.offset, geometry.tilt[1] * geometry.radius_package])


def orient(shape: JointShape, orientation: Orientation) -> JointShape:
    """Return the shape of a canonical joint, rotated and mirrored to an orientation.

    Args:
        shape: Shape of the joint in canonical orientation, as ``canonical`` defines it; not changed.
        orientation: Reflection and rotation about z, which ``canonical`` returned.

    Returns:
        Shape with transformed positions and velocities; metrics and history are equal.
    """
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
