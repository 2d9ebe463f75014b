"""Where a joint goes: from its own frame to its pad on the board, its head laid on the package's underside."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.board.pads import PadSite
from reflowshock.meshing.surface.closed_surface import ClosedSurface, pad_planes


class Underside(Protocol):
    """The underside of a package."""

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height (k,) over the board's top face at points (k,), (k,) [m]; ValueError beyond the package."""


@dataclass(frozen=True, slots=True)
class JointPlace:
    """The way of a joint to its site.

    Attributes:
        site: where its pads are.
        side: the package's underside.
        copper: thickness of the copper between the solder and that underside, but for a plate's, which is part of
            the package [m].
        head: the solder's upper face in its own frame.
    """

    site: PadSite
    side: Underside
    copper: float
    head: PadPlanes

    @classmethod
    def of(cls, surface: ClosedSurface, site: PadSite, side: Underside, copper: float) -> "JointPlace":
        """Take the upper face from the joint's closed surface."""
        return cls(site, side, copper, pad_planes(surface))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Move points (n, 3) [m] to the site; shear them in z so that the upper face gets where the package is."""
        share = np.clip(points[:, 2] / self.head.height(*points[:, :2].T), 0.0, 1.0)
        x, y = points[:, 0] + self.site.x, points[:, 1] + self.site.y
        return np.column_stack([x, y, self.site.z_board + points[:, 2] + share * self.rise(points)])

    def rise(self, points: np.ndarray) -> np.ndarray:
        """Return how far the upper face lies below its place at the x and y of points (n, 3) [m]: (n,)."""
        height = self.side.height(points[:, 0] + self.site.x, points[:, 1] + self.site.y)
        return height - self.copper - self.site.z_board - self.head.height(*points[:, :2].T)
