"""Planes of the two pads of a joint: map of a joint between tilted, offset pads to a straight one, and back."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class PadPlanes:
    """Plane of the package's pad above the board's pad at z = 0, in the joint's own frame.

    When a joint is straightened, a point at a fraction s of the height between both planes moves to the height s gap
    and by -s offset in plan. Planes remain planes, and areas in them keep their ratios.

    Attributes:
        gap: Height of the plane at ``offset`` [m].
        offset: Centre of the package's pad in plan, shape (2,) [m].
        slope: Slopes of the plane along x and y, shape (2,).
    """

    gap: float
    offset: np.ndarray
    slope: np.ndarray

    @classmethod
    def fit(cls, points: np.ndarray, triangles: np.ndarray) -> "PadPlanes":
        """Fit the plane to the triangles (t, 3) of a wetted disc by least squares about the centroid of its area."""
        corners = points[triangles]
        edges = corners[:, 1:, :2] - corners[:, :1, :2]
        weights = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
        centre = weights @ corners.mean(axis=1) / weights.sum()
        relative = points[np.unique(triangles)] - centre
        slope, *_ = np.linalg.lstsq(relative[:, :2], relative[:, 2], rcond=None)
        return cls(float(centre[2]), centre[:2], slope)

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height of the package's pad plane at x, y, shapes as x and y [m]."""
        return self.gap + self.slope[0] * (x - self.offset[0]) + self.slope[1] * (y - self.offset[1])

    def straighten(self, points: np.ndarray) -> np.ndarray:
        """Map points (n, 3) [m] of the joint to the straight joint, whose pads are parallel and coaxial."""
        height = self.height(points[:, 0], points[:, 1])
        share = np.clip(points[:, 2] / height, 0.0, 1.0)
        flat = points[:, :2] - share[:, None] * self.offset
        return np.column_stack([flat, points[:, 2] - share * (height - self.gap)])

    def restore(self, points: np.ndarray) -> np.ndarray:
        """Map points (n, 3) [m] of the straight joint back; points beyond the planes keep their distance from them."""
        share = np.clip(points[:, 2] / self.gap, 0.0, 1.0)
        x, y = (points[:, :2] + share[:, None] * self.offset).T
        return np.column_stack([x, y, points[:, 2] + share * (self.height(x, y) - self.gap)])
