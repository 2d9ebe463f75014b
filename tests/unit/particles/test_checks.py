import pytest

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.checks import problems
from reflowshock.particles.parameters.joint_checks import unverified_joints
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics

GEOMETRIES = {f"A{k}": JointGeometry(gap * 1e-3, 0.24e-3, 0.24e-3) for k, gap in enumerate((0.31, 0.325, 0.34), 1)}
PITCH = 1e-3


def keys(solder, geometries=GEOMETRIES):
    """Return the keys of the problems of solder in an array of joints."""
    return [problem.key for problem in problems(solder, geometries, PITCH)]


@pytest.mark.parametrize("volume", [0.05, 0.0724, 0.1])
def test_sound_volumes_pass(volume):
    assert keys(Solder(volume=volume * 1e-9)) == []


@pytest.mark.parametrize("volume", [0.32, 5.0])
def test_too_much_solder_cannot_fit(volume):
    (problem,) = problems(Solder(volume=volume * 1e-9), GEOMETRIES, PITCH)
    assert problem.key == "solder.volume"
    assert problem.value == f"{volume:.3g} mm^3"
    assert problem.allowed == "< 0.31 mm^3"
    assert "A1" in problem.message


def test_solder_that_may_touch_its_neighbour_or_span_no_gap_is_left_to_the_flow():
    assert keys(Solder(volume=0.26e-9)) == []
    assert keys(Solder(volume=0.012e-9)) == []


def test_a_neck_must_be_resolved():
    (problem,) = problems(Solder(volume=0.023e-9, numerics=SolderNumerics(spacing=1e-4)), GEOMETRIES, PITCH)
    assert problem.key == "solder.numerics.spacing"
    assert "A3" in problem.message and "neck" in problem.message


def test_spacing_must_resolve_the_joint():
    (problem,) = problems(Solder(volume=0.0724e-9, numerics=SolderNumerics(spacing=0.15e-3)), GEOMETRIES, PITCH)
    assert (problem.key, problem.value, problem.allowed) == ("solder.numerics.spacing", "0.15 mm", "<= 0.1033 mm")


def test_the_pad_must_be_wetted_better_than_the_mask():
    assert keys(Solder(volume=0.0724e-9, pad_contact_angle=2.0, mask_contact_angle=1.0)) == ["solder.pad_contact_angle"]


def test_joints_overflow_where_the_package_is_lowest_even_if_no_meridian_is_found_there():
    solder, drawn = Solder(volume=0.0724e-9, effects=SolderEffects(inertia="on")), GEOMETRIES.values()
    assert unverified_joints(drawn, solder) is None
    assert unverified_joints(drawn, solder, -0.02e-3) is None
    for way in (-0.17e-3, -0.26e-3):  # no meridian is available for a flat joint of 0.05 mm
        assert f"gap of {0.31 + 1e3 * way:.4g} mm" in unverified_joints(drawn, solder, way)
    assert unverified_joints(drawn, solder, -0.32e-3) is None  # no room at all, reported by other checks


def test_a_slip_length_belongs_to_a_wall_with_slip():
    assert keys(Solder(volume=0.0724e-9, wall="slip", slip_length=1e-5)) == []
    assert keys(Solder(volume=0.0724e-9, wall="no-slip")) == []
    assert keys(Solder(volume=0.0724e-9, wall="slip")) == ["solder.slip_length"]
    assert keys(Solder(volume=0.0724e-9, slip_length=1e-5)) == ["solder.slip_length"]
    gripc = SolderNumerics(scheme="gripc", time_step_limit=0.5)
    assert keys(Solder(volume=0.0724e-9, wall="no-slip", numerics=gripc)) == ["solder.wall"]
