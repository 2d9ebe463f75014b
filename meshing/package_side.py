"""The package's underside as its elements carry it: bilinear between grid points of the warped substrate."""

import numpy as np

from meshing.pads import lift
from meshing.parameters import Package, Warpage
from meshing.plan import package_axes


def side_lift(package: Package, warpage: Warpage, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the lift of the meshed underside at points (n,), (n,) [m]."""
    (low_x, high_x, share_x), (low_y, high_y, share_y) = (
        _cell(np.concatenate([part.lines() for part in axis]), np.abs(values))
        for axis, values in zip(package_axes(package), (x, y), strict=True)
    )
    return (1.0 - share_y) * (
        (1.0 - share_x) * lift(package, warpage, low_x, low_y) + share_x * lift(package, warpage, high_x, low_y)
    ) + share_y * (
        (1.0 - share_x) * lift(package, warpage, low_x, high_y) + share_x * lift(package, warpage, high_x, high_y)
    )


def _cell(lines: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Grid lines below and above each value, and where it lies between them (0 to 1)."""
    lines = np.unique(lines)
    above = np.clip(np.searchsorted(lines, values), 1, len(lines) - 1)
    low, high = lines[above - 1], lines[above]
    return low, high, (values - low) / (high - low)
