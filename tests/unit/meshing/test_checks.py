"""Contradictions between geometry parameters are found, named by key and by what is allowed."""

import pytest

from meshing.checks import problems
from meshing.parameters import Pad

MM = 1.0e-3


def test_a_sound_case_has_none(package, board, warpage):
    assert problems(package, board, warpage) == []


@pytest.mark.parametrize(
    ("change", "key", "text"),
    [
        ({"pitch": 0.5 * MM}, "package.package_pad.diameter", "pads overlap"),
        ({"rows": 3}, "package.rows", "even numbers"),
        ({"depopulated": ("A5",)}, "package.depopulated", "nearest"),
        ({"depopulated": ("A1",)}, "package.depopulated", "mirror images: A4, D1, D4"),
        ({"rows": 6, "columns": 6}, "package.substrate.length", "array of 6 pads"),
        ({"board_pad": Pad(diameter=0.4 * MM, mask_opening=0.5 * MM, definition="SMD")}, "package.board_pad.definition", "NSMD"),
    ],
)
def test_package_problems(package, board, warpage, change, key, text):
    found = problems(package.model_copy(update=change), board, warpage)
    assert any(finding.key == key and text in finding.allowed for finding in found), found


@pytest.mark.parametrize(
    ("change", "key", "text"),
    [
        ({"length": 4 * MM}, "package.substrate.length", "larger than the board"),
        ({"length": 14 * MM}, "board.length", "need their own elements"),
    ],
)
def test_board_problems(package, board, warpage, change, key, text):
    found = problems(package, board.model_copy(update=change), warpage)
    assert any(finding.key == key and text in finding.allowed for finding in found), found


def test_patch_as_thick_as_the_board(package, board, warpage):
    numerics = board.numerics.model_copy(update={"patch_layers": 4})
    found = problems(package, board.model_copy(update={"numerics": numerics}), warpage)
    assert [finding.key for finding in found] == ["board.numerics.patch_layers"]


def test_warpage_that_closes_a_gap(package, board, warpage):
    found = problems(package, board, warpage.model_copy(update={"corner": -0.29 * MM}))
    assert [finding.key for finding in found] == ["warpage.corner"]
    assert "A3" in found[0].allowed or "A4" in found[0].allowed
