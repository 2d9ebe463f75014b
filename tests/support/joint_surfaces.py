"""Synthetic joint surfaces of which everything is known."""

import numpy as np


def revolve(profile: np.ndarray, gap: float, around: int = 48, offset: float = 0.0):
    """Triangulate a body of revolution.

    Args:
        profile: (k,) radii [m] at equal steps of height from 0 to gap.
        gap: height [m].
        around: vertices a circle.
        offset: shift of the upper end along x [m], linear in height.

    Returns:
        Points, free triangles, lower ring, upper ring.
    """
    angles = 2.0 * np.pi * np.arange(around) / around
    shares = np.linspace(0.0, 1.0, len(profile))
    points = np.array(
        [(offset * s + r * np.cos(a), r * np.sin(a), gap * s) for s, r in zip(shares, profile, strict=True) for a in angles]
    )
    first = (np.arange(len(profile) - 1)[:, None] * around + np.arange(around)).ravel()
    second = (np.arange(len(profile) - 1)[:, None] * around + np.roll(np.arange(around), -1)).ravel()
    triangles = np.vstack(
        [np.column_stack([first, second, second + around]), np.column_stack([first, second + around, first + around])]
    )
    ring = np.arange(around)
    return points, triangles, ring, (len(profile) - 1) * around + ring
