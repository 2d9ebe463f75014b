"""A small package on a small board."""

import pytest

from meshing.parameters import Board, BoardNumerics, Copper, Holes, Layer, Package, Pad, Warpage

MM = 1.0e-3


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
