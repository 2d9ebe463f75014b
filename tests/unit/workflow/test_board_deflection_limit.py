"""Steinberg's deflection of a board: figures worked out by hand, the edge that counts, positions, range of validity."""

import numpy as np
import pytest

from reflowshock.fem.problem.failure import Failure
from reflowshock.parameters import with_value
from reflowshock.workflow.case.case import CASES
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.verdict.board_deflection import (
    BoardDeflection,
    Seat,
    allowed_deflection,
    deflection,
    position_factor,
)
from reflowshock.workflow.verdict.criterion import FAIL, NO_LIMIT, PASS, JudgedDrop

JEDEC = read_case(CASES / "jedec_bga/case.toml", oversubscribe=True)
TIME = np.linspace(0.0, 2e-3, 201)
NEIGHBOUR = {
    "at": (0.02625, 0.0), "rows": 2, "columns": 2, "pitch": 1e-3, "post": 5e-4, "standoff": 3e-4,
    "substrate": (0.02, 0.02, 4e-4), "die": (1e-3, 1e-3, 4e-4),
}  # fmt: skip


def judged(peak=2.5e-3, case=JEDEC, shape=None, **parameters):
    """Return the verdict on a board with a peak deflection [m]."""
    failure = Failure.model_validate({"board_deflection": parameters})
    swing = peak * np.sin(np.pi * TIME / TIME[-1]) if shape is None else peak * shape
    history = {"time": TIME, "board_centre": np.outer(swing, [0.0, 0.0, -1.0])}
    return BoardDeflection().judge(JudgedDrop(with_value(case, "shock.failure", failure), {}, history))


def with_packages(case=JEDEC, **packages):
    """Return a case with further packages on its board."""
    table = case.model_dump() | {"packages": {name: NEIGHBOUR | item for name, item in packages.items()}}
    return type(case).model_validate(table)


def test_the_default_case_allows_what_is_worked_out_by_hand():
    # 6 x 0.00022 x 5.197 / (1.75 x 0.03937 x sqrt(0.4331)) = 0.1513 inches
    result = judged()
    assert result.limit == pytest.approx(0.1513 * 0.0254, rel=1e-3)
    assert (result.verdict, result.margin) == (PASS, pytest.approx(1.54, abs=0.005))
    assert "B = 132 mm, the board's length (holes farther apart)" in result.why
    assert "margin 0.9 with B = 77 mm, the board's width" in result.why


def test_the_other_edge_can_be_chosen():
    result = judged(along="width")
    assert (result.verdict, result.margin) == (FAIL, pytest.approx(0.897, abs=0.002))
    assert "farther" not in result.why and "margin 1.5 with B = 132 mm" in result.why


@pytest.mark.parametrize(
    ("component", "constant"),
    [("axial", 0.75), ("dip", 1.0), ("pga", 1.0), ("pga_two_rows", 1.26), ("side_brazed", 1.26), ("leadless", 2.25)],
)
def test_the_limit_falls_with_the_constant_of_the_component(component, constant):
    assert judged(component=component).limit == pytest.approx(1.75 / constant * judged().limit)


def test_the_limit_scales_with_thickness_and_length_of_the_component():
    seat, board = Seat("it", (0.01, 0.01)), JEDEC.board
    thick = with_value(board, "thickness", 2.0 * board.thickness)
    assert allowed_deflection(thick, seat, 0, 1.75) == pytest.approx(0.5 * allowed_deflection(board, seat, 0, 1.75))
    longer = Seat("it", (0.04, 0.01))
    assert allowed_deflection(board, longer, 0, 1.75) == pytest.approx(0.5 * allowed_deflection(board, seat, 0, 1.75))


def test_the_position_factor_is_the_first_mode_between_the_holes():
    at = {(0.0, 0.0): 1.0, (0.02625, 0.0): 0.7071, (0.02625, 0.01775): 0.5}  # holes 105 x 71 mm apart
    for place, factor in at.items():
        assert position_factor(JEDEC.board, place) == pytest.approx(factor, abs=1e-4)
    assert position_factor(JEDEC.board, (0.06, 0.0)) is None


def test_a_further_package_is_compared_with_the_deflection_of_the_centre():
    wide = judged(case=with_packages(big={"substrate": (0.03, 0.02, 4e-4)}))
    # L = 30 mm instead of 11 mm lowers the limit, r = 0.707 raises it
    assert wide.limit == pytest.approx(judged().limit * np.sqrt(11 / 30) / np.sqrt(0.5), rel=1e-4)
    assert "packages.big: B = 132 mm" in wide.why and "r = 0.707" in wide.why
    assert judged(case=with_packages(big={})).limit == judged().limit
    near = judged(case=with_packages(big={"at": (0.016, 0.0)}))
    assert "packages.big" in near.why and near.limit < judged().limit


def test_a_local_deflection_has_no_position_factor():
    off_centre = with_value(JEDEC, "board.centre", (0.01, 0.0))
    assert "the package: " in judged(case=off_centre).why and "r = 1;" in judged(case=off_centre).why
    assert judged(case=off_centre).limit == judged().limit
    assert "packages" not in judged(case=with_packages(off_centre, big={"at": (0.016, 0.0)})).why


def test_the_deflection_counts_from_the_start():
    history = {"board_centre": np.outer([1e-4, 5e-4, -3e-4], [0.0, 0.0, 1.0])}
    assert deflection(history) == pytest.approx([0.0, 4e-4, 4e-4])


def test_a_deflection_that_still_grows_is_judged_only_if_it_fails():
    rising = TIME / TIME[-1]
    growing = judged(shape=rising)
    assert (growing.verdict, growing.value, growing.limit) == (NO_LIMIT, 2.5e-3, None)
    assert "still grows at the end of the run, 2 ms" in growing.why
    assert judged(5e-3, shape=rising).verdict == FAIL
    assert judged(shape=rising, apply="on").verdict == PASS


def test_supports_that_move_exclude_the_rule():
    springs = {"screws": {"on": "mounting_holes", "hold": ("x", "y"), "bedding": {"z": 1e9}}}
    table = JEDEC.model_dump() | {"supports": springs}
    assert "rigid supports" in judged(case=type(JEDEC).model_validate(table)).why
    table["supports"] = {"screws": {"on": "mounting_holes", "hold": ("x", "y", "z")}}
    assert judged(case=type(JEDEC).model_validate(table)).applies


def test_it_can_be_switched_off():
    assert judged(apply="off").why == "shock.failure.board_deflection.apply = off"


def test_no_deflection_has_no_margin():
    assert (judged(0.0).verdict, judged(0.0).margin) in ((PASS, None), (NO_LIMIT, None))
