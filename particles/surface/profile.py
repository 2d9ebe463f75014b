"""Profile of a liquid body: equivalent radius of its horizontal cross-sections against height, width and waist.

The areas A(z) of the polygonal cross-sections are fitted by a polynomial. The integral of A is the volume, which the
flow conserves exactly, so the fit has neither the bias of single vertices, which lie outside the smooth surface, nor
that of chords, which lie inside.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.polynomial import Legendre

from reflowshock.arrays import Floats, Indices

# Relative heights of the cross-sections, from -1 to 1.
NODES = np.polynomial.legendre.leggauss(64)[0]
# Degree of the polynomial of the areas.
DEGREE = 6
# Heights at which a profile is sampled.
SAMPLES = 401
# Newton iterations for the height of an apex.
APEX_PASSES = 4
# Horizontal directions over which the width is averaged.
DIRECTIONS = 36


@dataclass(frozen=True, slots=True)
class Profile:
    """Equivalent radius of the cross-sections against height.

    Attributes:
        z: Heights from bottom to top, shape (k,) [m].
        radius: Radius of the disc of equal area, shape (k,) [m].
        areas: Fitted areas of the cross-sections against height [m^2].
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
        """Return the height of a drop, between the apexes where the fitted areas vanish or from its wall [m].

        Args:
            walls: Number of walls that the drop touches, 0 or 1.
        """
        foot = float(self.z[0]) if walls else self._apex(self.z[0])
        return self._apex(self.z[-1]) - foot

    def _apex(self, end: float) -> float:
        """Return the zero of the areas near an end [m] by Newton's method; near its apex a body is a paraboloid."""
        slope = self.areas.deriv()
        for _ in range(APEX_PASSES):
            end = end - self.areas(end) / slope(end)
        return float(end)


@njit(cache=True)
def section_areas(points, triangles, heights):
    """Compute the areas of horizontal cross-sections of a surface between its walls.

    The shoelace formula is summed over the cut segments, which have the liquid on their left seen from +z.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
        heights: Heights of the planes, ascending and not at a vertex, shape (k,) [m].

    Returns:
        Areas, shape (k,) [m^2].
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
    """Fit the profile of a free surface.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Outward oriented triangles of the free surface, shape (t, 3).
        span: Lowest and highest height of the fit [m]; by default of the vertices.
        parts: Number of parts like this one that planes of symmetry through the z axis make of the whole body.

    Returns:
        Radius of the disc of equal area by height, with the fitted areas of the cross-sections.
    """
    z = points[np.unique(triangles), 2]
    low, high = span or (float(z.min()), float(z.max()))
    return fit_areas(lambda heights: parts * section_areas(points, triangles, heights), low, high)


def fit_areas(areas: Callable[[Floats], Floats], low: float, high: float) -> Profile:
    """Fit the profile to a function that returns the areas (k,) [m^2] of cross-sections at heights (k,) [m].

    Args:
        areas: Function of the heights.
        low: Lowest height [m].
        high: Highest height [m].

    Returns:
        Radius of the disc of equal area by height, with the fitted areas.
    """
    heights = 0.5 * (low + high) + 0.5 * (high - low) * NODES
    return Profile.of(Legendre.fit(heights, areas(heights), DEGREE, domain=[low, high]))


def mean_width(points: Floats) -> float:
    """Return the horizontal width of a surface, averaged over directions [m].

    Args:
        points: Vertices, shape (m, 3) [m], z up.
    """
    angles = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    along = points[:, :2] @ np.stack((np.cos(angles), np.sin(angles)))
    return float(np.ptp(along, axis=0).mean())
