"""Cross-sections of the tracked surface: equivalent radius against height, width and waist.

The area A(z) of the polygonal cross-sections is fitted by a polynomial. The integral of A is the volume, which the flow
keeps exactly, so the fit is free of the bias of single vertices (outside the smooth surface) and chords (inside it).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.polynomial import Legendre

from reflowshock.arrays import Floats, Indices

NODES = np.polynomial.legendre.leggauss(64)[0]
DEGREE = 6
SAMPLES = 401
APEX_PASSES = 4
DIRECTIONS = 36  # over which the width is averaged


@dataclass(frozen=True, slots=True)
class Profile:
    """Equivalent radius of the cross-sections.

    Attributes:
        z: `(k,)` heights from foot to head [m].
        radius: `(k,)` radius of the disc of equal area [m].
        areas: fitted areas of the cross-sections against their height [m^2].
    """

    z: Floats
    radius: Floats
    areas: Legendre

    @classmethod
    def of(cls, areas: Legendre) -> "Profile":
        """Sample the fitted areas on their domain."""
        low, high = areas.domain
        sample = np.linspace(low, high, SAMPLES)
        return cls(sample, np.sqrt(np.maximum(areas(sample), 0.0) / np.pi), areas)

    @property
    def max_width(self) -> float:
        """Largest diameter [m]."""
        return 2.0 * float(self.radius.max())

    @property
    def waist(self) -> float:
        """Smallest diameter [m]."""
        return 2.0 * float(self.radius.min())

    def drop_height(self, walls: int) -> float:
        """Height of a drop on a wall, or of a free one, to the apex where the fitted areas vanish [m].

        As free of the bias of single vertices as the width is.
        """
        foot = float(self.z[0]) if walls else self._apex(self.z[0])
        return self._apex(self.z[-1]) - foot

    def _apex(self, end: float) -> float:
        """Zero of the areas next to an end [m], by Newton's method: near its apex a body is a paraboloid."""
        slope = self.areas.deriv()
        for _ in range(APEX_PASSES):
            end = end - self.areas(end) / slope(end)
        return float(end)


@njit(cache=True)
def section_areas(points, triangles, heights):
    """Areas of the cross-sections of a surface at heights between its walls.

    Args:
        points: `(n, 3)` [m].
        triangles: `(t, 3)` outward oriented.
        heights: `(k,)` of the planes, ascending, at no vertex [m].

    Returns:
        `(k,)` [m^2], by the shoelace formula on the cut segments, the liquid on their left seen from +z.
    """
    areas, ends = np.zeros(heights.shape[0]), np.empty((2, 2))
    for t in range(triangles.shape[0]):
        z = points[triangles[t, 0], 2], points[triangles[t, 1], 2], points[triangles[t, 2], 2]
        for k in range(np.searchsorted(heights, min(z)), np.searchsorted(heights, max(z))):
            above = z[0] > heights[k], z[1] > heights[k], z[2] > heights[k]
            is_single = above[0] + above[1] + above[2] == 1
            lone = 0 if above[0] == is_single else 1 if above[1] == is_single else 2
            apex = points[triangles[t, lone]]
            for turn in range(2):
                other = points[triangles[t, (lone + turn + 1) % 3]]
                part = (heights[k] - apex[2]) / (other[2] - apex[2])
                for d in range(2):
                    ends[turn, d] = apex[d] + part * (other[d] - apex[d])
            twice = ends[0, 0] * ends[1, 1] - ends[0, 1] * ends[1, 0]
            areas[k] += 0.5 * twice if is_single else -0.5 * twice
    return areas


def fit_profile(points: Floats, triangles: Indices, span: tuple[float, float] | None = None, parts: int = 1) -> Profile:
    """Fit the equivalent radius of a free surface.

    Args:
        points: `(n, 3)` [m].
        triangles: `(t, 3)` of the free surface, outward oriented.
        span: heights of the fit [m]; by default from the lowest to the highest point.
        parts: of how many such parts, about planes of symmetry through the z axis, the body consists.
    """
    z = points[np.unique(triangles), 2]
    low, high = span or (float(z.min()), float(z.max()))
    return fit_areas(lambda heights: parts * section_areas(points, triangles, heights), low, high)


def fit_areas(areas: Callable[[Floats], Floats], low: float, high: float) -> Profile:
    """Fit the areas `(k,)` [m^2] of cross-sections at heights `(k,)` between two [m]."""
    heights = 0.5 * (low + high) + 0.5 * (high - low) * NODES
    return Profile.of(Legendre.fit(heights, areas(heights), DEGREE, domain=[low, high]))


def width(points: Floats) -> float:
    """Horizontal width of a surface `(m, 3)` [m], the mean over directions."""
    angles = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    along = points[:, :2] @ np.stack((np.cos(angles), np.sin(angles)))
    return float(np.ptp(along, axis=0).mean())
