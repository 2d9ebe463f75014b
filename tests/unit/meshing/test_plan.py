import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reflowshock.cases.hard.trials.packages import MM, board, package
from reflowshock.meshing.board.plan import Interval, board_plan, footprint, package_plan, patch


def test_graded_lines_keep_their_ratio():
    lines = Interval(1.0, 8.0, 3, 2.0).lines()
    assert lines == pytest.approx([1.0, 2.0, 4.0, 8.0])
    mirrored = Interval(1.0, 8.0, 3, 2.0).mirrored()
    assert mirrored.lines() == pytest.approx([-8.0, -4.0, -2.0, -1.0])
    assert mirrored.smallest() == pytest.approx(1.0)


@pytest.mark.parametrize("ratio", [1.0, 1.01, 0.99])
def test_the_shortest_of_very_many_cells_is_known_without_their_lines(monkeypatch, ratio):
    interval = Interval(1.0, 8.0, 3000, ratio)
    laid_out = interval.smallest()
    monkeypatch.setattr("reflowshock.meshing.board.plan.MOST_LINES", 10)
    assert interval.smallest() == pytest.approx(laid_out, rel=1e-9)
    assert Interval(0.0, 1.0, 10**12).smallest() == 1e-12


def test_axis_is_covered_without_gap():
    for symmetry, start in (("quarter", 0.0), ("full", -20.0 * MM)):
        axis = board_plan(package(), board(symmetry=symmetry)).x
        assert axis[0].start == pytest.approx(start)
        assert axis[-1].end == pytest.approx(20.0 * MM)
        assert [part.end for part in axis[:-1]] == [part.start for part in axis[1:]]


def test_die_edges_lie_on_grid_lines():
    die = {"length": 3.3 * MM, "width": 2.9 * MM, "thickness": 0.4 * MM}
    plan = package_plan(package(die=die), board())
    assert plan.x[0].end == pytest.approx(1.65 * MM)
    assert plan.y[0].end == pytest.approx(1.45 * MM)


def test_a_die_that_rounding_makes_smaller_covers_its_substrate():
    die = {"length": 4.999999999999999 * MM, "width": 5.0 * MM, "thickness": 0.4 * MM}
    plan = package_plan(package(die=die), board())
    assert len(plan.x) == len(plan.y) == 1


def test_patch_is_the_footprint_and_its_margin():
    plan = board_plan(package(), board())
    assert footprint(plan, package()) == {(0, 0)}
    assert patch(plan, package()) == {(0, 0), (0, 1), (1, 0), (1, 1)}
    assert plan.x[1].end == pytest.approx(3.5 * MM)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.3, 1.0), st.floats(1.0, 4.0), st.floats(1.05, 1.6), st.floats(2.5, 8.0))
def test_cells_grow_gently_and_stay_above_half_the_fine_size(size, coarse, growth, inset):
    numerics = {"element_size": size * MM, "coarse_size": coarse * MM, "growth": growth}
    holes = {"diameter": 2.0 * MM, "inset_x": inset * MM, "inset_y": inset * MM}
    axis = board_plan(package(), board(length=80 * MM, width=70 * MM, numerics=numerics, holes=holes)).x
    cells = np.concatenate([np.diff(part.lines()) for part in axis])
    assert cells.min() > 0.3 * size * MM
    outside_hole = np.concatenate([np.diff(part.lines()) for part in axis[:-2]])
    assert (outside_hole[1:] / outside_hole[:-1]).max() < 1.5 * growth
