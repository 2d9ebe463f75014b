"""A small package, and synthetic joint surfaces of which everything is known."""

import numpy as np
import pytest

from meshing.parameters import Board, BoardNumerics, Copper, Holes, Layer, Package, Pad, Warpage

MM = 1.0e-3


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


@pytest.fixture
def package() -> Package:
    return Package(
        rows=4, columns=4, pitch=MM, standoff=0.3 * MM,
        board_pad=Pad(diameter=0.48 * MM, mask_opening=0.58 * MM, definition="NSMD"),
        package_pad=Pad(diameter=0.58 * MM, mask_opening=0.48 * MM, definition="SMD"),
        substrate=Layer(length=5 * MM, width=5 * MM, thickness=0.4 * MM), die=Layer(length=3 * MM, width=3 * MM, thickness=0.4 * MM),
        copper=Copper(thickness=0.02 * MM),
    )  # fmt: skip


@pytest.fixture
def board() -> Board:
    return Board(
        length=40 * MM, width=30 * MM, thickness=MM, holes=Holes(diameter=2 * MM, inset_x=4 * MM, inset_y=4 * MM),
        numerics=BoardNumerics(element_size=0.5 * MM, coarse_size=2 * MM),
    )  # fmt: skip


@pytest.fixture
def warpage() -> Warpage:
    return Warpage(corner=0.03 * MM)
