"""The plane of a package's pad above that of the board's: joints made straight between them, and put back."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class PadPlanes:
    """The package's pad over the plane z = 0 of the board's, in the joint's own frame.

    A point at a share s of the height between both planes keeps this share when the joint is made straight: it goes to
    s gap, and back by s times the offset. Planes become planes, and areas in them keep their ratios.

    Attributes:
        gap: height of the plane at ``offset`` [m].
        offset: (2,) centre of the package's pad [m].
        slope: (2,) rise of the plane along x and y.
    """

    gap: float
    offset: np.ndarray
    slope: np.ndarray

    @classmethod
    def fit(cls, points: np.ndarray, triangles: np.ndarray) -> "PadPlanes":
        """Lay the plane through the triangles (t, 3) of a wetted disc, by least squares about its centre of area."""
        corners = points[triangles]
        edges = corners[:, 1:, :2] - corners[:, :1, :2]
        weights = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
        centre = weights @ corners.mean(axis=1) / weights.sum()
        relative = points[np.unique(triangles)] - centre
        slope, *_ = np.linalg.lstsq(relative[:, :2], relative[:, 2], rcond=None)
        return cls(float(centre[2]), centre[:2], slope)

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height of the package's pad plane at x, y [m]."""
        return self.gap + self.slope[0] * (x - self.offset[0]) + self.slope[1] * (y - self.offset[1])

    def straighten(self, points: np.ndarray) -> np.ndarray:
        """Move points (n, 3) [m] to where they are when the package's pad faces the board's; (n, 3) [m]."""
        height = self.height(points[:, 0], points[:, 1])
        share = np.clip(points[:, 2] / height, 0.0, 1.0)
        flat = points[:, :2] - share[:, None] * self.offset
        return np.column_stack([flat, points[:, 2] - share * (height - self.gap)])

    def restore(self, points: np.ndarray) -> np.ndarray:
        """Undo ``straighten``; what reaches beyond the planes keeps its distance from them."""
        share = np.clip(points[:, 2] / self.gap, 0.0, 1.0)
        x, y = (points[:, :2] + share[:, None] * self.offset).T
        return np.column_stack([x, y, points[:, 2] + share * (self.height(x, y) - self.gap)])
