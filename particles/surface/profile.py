"""Cross-sections of the tracked surface: equivalent radius against height, width and waist.

The area A(z) of the polygonal cross-sections is fitted by a polynomial. The integral of A is the volume, which the flow
keeps exactly, so the fit is free of the bias of single vertices (outside the smooth surface) and chords (inside it).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Legendre

from reflowshock.arrays import Floats, Indices

SLICES = 64
DEGREE = 6
SAMPLES = 401
APEX_PASSES = 4


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


def section_areas(points: Floats, triangles: Indices, heights: Floats) -> Floats:
    """Areas of the cross-sections of a surface at heights between its walls.

    Args:
        points: `(n, 3)` [m].
        triangles: `(t, 3)` outward oriented.
        heights: `(k,)` of the planes, at no vertex [m].

    Returns:
        `(k,)` [m^2], by the shoelace formula on the cut segments.
    """
    corner = points[triangles]
    areas = np.empty(len(heights))
    for k, height in enumerate(heights):
        above = corner[:, :, 2] > height
        cut = corner[above.any(axis=1) & ~above.all(axis=1)]
        ends = _segments(cut, height)
        areas[k] = 0.5 * (ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 0, 1] * ends[:, 1, 0]).sum()
    return areas


def _segments(corner: Floats, height: float) -> Floats:
    """Segments `(c, 2, 2)` in which a plane cuts triangles, the liquid on their left seen from +z."""
    above = corner[:, :, 2] > height
    lone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    row = np.arange(len(corner))
    apex = corner[row, lone]
    ends = []
    for turn in (1, 2):
        other = corner[row, (lone + turn) % 3]
        part = (height - apex[:, 2]) / (other[:, 2] - apex[:, 2])
        ends.append(apex[:, :2] + part[:, None] * (other - apex)[:, :2])
    segment = np.stack(ends, axis=1)
    single_above = above[row, lone]
    segment[~single_above] = segment[~single_above][:, ::-1]
    return segment


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
    nodes, _ = np.polynomial.legendre.leggauss(SLICES)
    heights = 0.5 * (low + high) + 0.5 * (high - low) * nodes
    return Profile.of(Legendre.fit(heights, areas(heights), DEGREE, domain=[low, high]))
