"""Rigid motions of the two bodies that a reflow has, board and package: which are free, and where to pin them."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

MOTIONS = ("x", "y", "z", "turn_x", "turn_y", "turn_z")
BLOCKED = 1e-9  # of the body's size: a motion that moves a held component less is free


@dataclass(frozen=True, slots=True)
class RigidMotions:
    """Free rigid motions of one body, displacements linear in the turns.

    Attributes:
        centre: ``(3,)`` [m] that the turns are about.
        numbers: Free ones, numbers in ``MOTIONS``.
    """

    centre: NDArray[np.float64]
    numbers: tuple[int, ...]

    @classmethod
    def free(cls, points: NDArray[np.float64], held: NDArray[np.bool_], centre: NDArray[np.float64]) -> "RigidMotions":
        """Find the motions of a body with ``points (n, 3)`` [m] that no held component ``(n, 3)`` blocks."""
        every = cls(centre, tuple(range(6)))
        limit = BLOCKED * float(np.ptp(points, axis=0).max())
        moved = [np.abs(field[held]).max(initial=0.0) for field in every.fields(points)]
        return cls(centre, tuple(number for number, move in zip(every.numbers, moved, strict=True) if move <= limit))

    @property
    def names(self) -> tuple[str, ...]:
        """Return their names: shifts along and turns about x, y, z."""
        return tuple(MOTIONS[number] for number in self.numbers)

    def fields(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement at ``points (n, 3)`` of a unit of each motion: ``(k, n, 3)`` [m/m, m/rad]."""
        axes = np.eye(3)
        fields = [
            np.broadcast_to(axes[number], points.shape)
            if number < 3
            else np.cross(axes[number - 3], points - self.centre)
            for number in self.numbers
        ]
        return np.array(fields).reshape(len(fields), *points.shape)

    def pins(self, points: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the points and components ``(k,)`` whose values determine the motions, far apart where they turn."""
        size = float(np.ptp(points, axis=0).max())
        scale = np.array([1.0 if number < 3 else 1.0 / size for number in self.numbers])
        fields = scale[:, None] * self.fields(points).reshape(len(self.numbers), points.size)
        order = scipy.linalg.qr(fields, mode="r", pivoting=True)[1][: len(self.numbers)]
        node, component = np.divmod(order, 3)
        return node, component
