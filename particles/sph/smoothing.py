"""Smoothing kernels W of one pair as functions of q = distance / h, in one, two and three dimensions.

The radius of the support is 2 h. Sources: cubic spline, Monaghan 1992; Wendland C2, Wendland 1995 and Dehnen & Aly
2012.
"""

from functools import lru_cache
from math import pi

import numpy as np
from numba import njit
from scipy.integrate import trapezoid

from reflowshock.arrays import Floats

CUBIC_SPLINE, WENDLAND_C2 = 0, 1
KERNELS = {"cubic_spline": CUBIC_SPLINE, "wendland": WENDLAND_C2}
# Radius of the support in smoothing lengths h.
SUPPORT = 2.0
# sigma h^d in one, two and three dimensions, the inverse of the integral of W / sigma over q.
NORMS = {
    CUBIC_SPLINE: (2.0 / 3.0, 10.0 / (7.0 * pi), 1.0 / pi),
    WENDLAND_C2: (5.0 / 8.0, 7.0 / (4.0 * pi), 21.0 / (16.0 * pi)),
}


def norm(kernel: int, dimension: int, length: float) -> float:
    """Return the normalisation sigma of a kernel, with which its integral over space is one, in 1/m^dimension.

    Args:
        kernel: ``CUBIC_SPLINE`` or ``WENDLAND_C2``.
        dimension: Dimension of the flow, 1 to 3.
        length: Smoothing length h [m].
    """
    return NORMS[kernel][dimension - 1] / length**dimension


@njit(cache=True, error_model="numpy")
def shape(kernel, line, q):
    """Return the smoothing kernel W over its normalisation sigma, a scalar without unit.

    All branches are computed and one is selected, so that a loop can compute several pairs at a time.

    Args:
        kernel: ``CUBIC_SPLINE`` or ``WENDLAND_C2``.
        line: Whether the flow has one dimension, a boolean.
        q: Distance over the smoothing length, scalar >= 0; W vanishes from q = 2.
    """
    rest, half = 2.0 - q, 1.0 - 0.5 * q
    spline = 1.0 - 1.5 * q * q * half if q < 1.0 else 0.25 * rest * rest * rest
    wendland = half * half * half * (1.5 * q + 1.0 if line else half * (2.0 * q + 1.0))
    inside = spline if kernel == CUBIC_SPLINE else wendland
    return inside if q < 2.0 else 0.0


@njit(cache=True, error_model="numpy")
def slope(kernel, line, q):
    """Return the slope of the smoothing kernel, (dW / dq) / (sigma q), a scalar without unit.

    The gradient of W is this times sigma / h^2 times the vector between the points; sigma is its normalisation.

    Args:
        kernel: ``CUBIC_SPLINE`` or ``WENDLAND_C2``.
        line: Whether the flow has one dimension, a boolean.
        q: Distance over the smoothing length h, scalar >= 0; the slope vanishes from q = 2.
    """
    rest, half = 2.0 - q, 1.0 - 0.5 * q
    spline = -3.0 + 2.25 * q if q < 1.0 else -0.75 * rest * rest / q
    wendland = half * half * (-3.0 if line else -5.0 * half)
    inside = spline if kernel == CUBIC_SPLINE else wendland
    return inside if q < 2.0 else 0.0


def share_beyond_plane(kernel: int, distance: Floats) -> Floats:
    """Return the share of the integral of a kernel W about each point that lies beyond a plane, in space, shape (n,).

    Of a sphere of radius r about the point the area 2 pi r (r - distance) is beyond the plane.

    Args:
        kernel: ``CUBIC_SPLINE`` or ``WENDLAND_C2``.
        distance: Distances of the points from the plane over h, shape (n,).
    """
    return np.interp(distance, *_table_beyond_plane(kernel))


@lru_cache
def _table_beyond_plane(kernel: int) -> tuple[Floats, Floats]:
    radius = np.linspace(0.0, SUPPORT, 801)
    level = norm(kernel, 3, 1.0) * np.array([shape(kernel, False, r) for r in radius])
    area = 2.0 * pi * radius * np.maximum(radius - radius[:, None], 0.0)
    return radius, trapezoid(level * area, radius, axis=1)
