import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reflowshock.cases.hard.trials.packages import MM
from reflowshock.cases.hard.trials.surfaces import barrel, laid_between
from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.surface.closed_surface import enclosed_volume, measure, pad_planes

SMALL = st.floats(-0.08, 0.08)


@settings(max_examples=30, deadline=None)
@given(st.tuples(SMALL, SMALL), st.tuples(SMALL, SMALL))
def test_a_joint_is_put_back_where_it_was(offset, slope):
    planes = PadPlanes(0.3 * MM, np.array(offset) * MM, np.array(slope))
    points = np.random.default_rng(1).uniform(-0.3 * MM, 0.3 * MM, (200, 3))
    assert planes.restore(planes.straighten(points)) == pytest.approx(points, abs=1e-17)


def test_planes_are_found_and_become_horizontal():
    surface = laid_between(barrel(0.3 * MM, 0.05 * MM), (0.07 * MM, -0.02 * MM), (0.05, -0.08))
    planes = pad_planes(surface)
    assert planes.gap == pytest.approx(0.3 * MM, rel=1e-12)
    assert planes.offset == pytest.approx([0.07 * MM, -0.02 * MM], rel=1e-9)
    assert planes.slope == pytest.approx([0.05, -0.08], rel=1e-9)
    straight = planes.straighten(surface.points)
    assert straight == pytest.approx(barrel(0.3 * MM, 0.05 * MM).points, abs=1e-15)


def test_measures_of_a_tilted_joint_are_those_along_its_own_sections():
    straight = barrel(0.3 * MM, 0.05 * MM)
    tilted = laid_between(straight, (0.07 * MM, 0.0), (0.0, 0.087))
    measured, expected = measure(tilted), measure(straight)
    for name in ("standoff", "max_width", "contact_radius_board"):
        assert measured[name] == pytest.approx(expected[name], rel=1e-9)
    assert measured["contact_radius_package"] == pytest.approx(
        expected["contact_radius_package"] * (1.0 + 0.087**2) ** 0.25, rel=1e-9
    )
    assert measured["volume"] == pytest.approx(enclosed_volume(tilted))
