import pytest

from reflowshock.particles.scenes.bridge import contacts, neighbours

PITCH = 1e-3
ROW = {f"A{k}": ((k - 0.5) * PITCH, 2.5 * PITCH) for k in (1, 2, 3)}
NARROW = dict.fromkeys(ROW, 0.9e-3)


def test_joints_narrower_than_their_pitch_do_not_touch():
    assert contacts(ROW, NARROW, mirrored=True) == []


def test_two_joints_touch_where_their_mean_width_reaches_the_pitch():
    (contact,) = contacts(ROW, NARROW | {"A3": 1.12e-3}, mirrored=True)
    assert (contact.first, contact.second) == ("A2", "A3")
    assert contact.distance == pytest.approx(PITCH)
    assert contact.overlap == pytest.approx(0.01e-3)


def test_the_largest_overlap_comes_first_and_each_joint_knows_whom_it_touches():
    overlaps = contacts(ROW, {"A1": 0.98e-3, "A2": 1.03e-3, "A3": 1.2e-3}, mirrored=False)
    assert [(contact.first, contact.second) for contact in overlaps] == [("A2", "A3"), ("A1", "A2")]
    assert neighbours(overlaps) == {"A1": ["A2"], "A2": ["A1", "A3"], "A3": ["A2"]}


def test_a_joint_touches_its_mirror_image():
    widths = NARROW | {"A1": 1.05e-3}
    assert contacts(ROW, widths, mirrored=False) == []
    (contact,) = contacts(ROW, widths, mirrored=True)
    assert (contact.first, contact.second) == ("A1", "A1")
    assert contact.distance == pytest.approx(PITCH)
