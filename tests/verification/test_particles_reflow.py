"""Joints and drops at rest against the Young-Laplace shapes; order of convergence asserted."""

import numpy as np
import pytest

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.reference.young_laplace import joint_meridian, sessile_meridian
from reflowshock.particles.scenes.metrics import mean_angle, verdict
from reflowshock.particles.scenes.reflow import solve_joint
from reflowshock.particles.surface.profile import fit_profile
from tests.support.drops import solve_drop

BALL, RADIUS, GAMMA = 0.0724e-9, 0.24e-3, 0.4985
WEIGHT = 8930.0 * 9.81


def error(actual, expected):
    """Return the relative error of a value."""
    return actual / expected - 1.0


@pytest.mark.parametrize(
    "gap", [0.28e-3, *(pytest.param(gap, marks=pytest.mark.long) for gap in (0.31e-3, 0.34e-3)), 0.42e-3]
)
def test_default_joints(gap):
    """At the default resolution bulges and hourglasses have widths within 0.5 % and volumes within 0.1 %."""
    shape = solve_joint(JointGeometry(gap, RADIUS, RADIUS), Solder(volume=BALL))
    value = {name: number for name, (number, _) in shape.metrics.items()}
    exact = joint_meridian(BALL, RADIUS, RADIUS, gap, GAMMA, WEIGHT)
    assert shape.verdict == "ok"
    assert abs(error(value["max_width"], exact.max_width)) < 5e-3
    assert abs(error(value["waist"], exact.waist)) < 5e-3
    assert value["width_error"] == pytest.approx(error(value["max_width"], exact.max_width), abs=1e-9)
    assert abs(value["volume_drift"]) < 1e-6
    assert value["mean_pressure"] == pytest.approx(exact.pressure - WEIGHT * gap / 2, rel=0.03)
    assert value["contact_angle_board"] == pytest.approx(np.degrees(exact.angle_board), abs=3.0)
    assert value["contact_angle_package"] == pytest.approx(np.degrees(exact.angle_package), abs=3.0)
    assert value["axial_force"] == pytest.approx(exact.axial_force, abs=0.05 * 2 * np.pi * GAMMA * RADIUS)
    assert value["contact_radius_board"] == pytest.approx(RADIUS, rel=1e-9)
    assert value["capillary_number_at_rest"] < 1e-5
    assert value["pressure_scatter"] < 0.02


def test_width_converges_with_the_spacing():
    """The piecewise flat surface is of second order, asserted over a factor of 2.5 in spacing."""
    exact = joint_meridian(BALL, RADIUS, RADIUS, 0.31e-3, GAMMA, WEIGHT)
    spacings, errors = np.array([1e-4, 7e-5, 5e-5, 4e-5]), []
    for spacing in spacings:
        solder = Solder(volume=BALL, numerics=SolderNumerics(spacing=spacing))
        shape = solve_joint(JointGeometry(0.31e-3, RADIUS, RADIUS), solder)
        errors.append(abs(error(shape.metrics["max_width"][0], exact.max_width)))
    order = np.polyfit(np.log(spacings), np.log(errors), 1)[0]
    assert order > 1.5, errors


@pytest.mark.parametrize("degrees", [*(pytest.param(angle, marks=pytest.mark.long) for angle in (60, 90)), 120])
def test_a_cube_becomes_a_spherical_cap(degrees):
    """Hu et al. 4.1 (published errors: 0.9-3.3 %) with 343 particles, free contact line, quasi-static."""
    numerics = SolderNumerics(time_step_limit=100)
    angle = np.radians(degrees)
    solder = Solder(volume=1e-9, pad_contact_angle=angle, effects=SolderEffects(gravity="off"), numerics=numerics)
    flow, run = solve_drop(solder, 7)
    exact = sessile_meridian(1e-9, angle, GAMMA)
    assert abs(error(run.records[-1].height, exact.height)) < 0.01
    assert abs(error(run.profiles[-1].max_width, exact.max_width)) < 0.01
    assert flow.body.volume()[0] == pytest.approx(1e-9, rel=1e-6)


def test_a_heavy_drop_sags():
    """Bond number 0.1757 (1 mm^3 of solder) at 120 degrees: Bashforth-Adams."""
    numerics = SolderNumerics(time_step_limit=100)
    flow, run = solve_drop(Solder(volume=1e-9, pad_contact_angle=np.radians(120), numerics=numerics), 7)
    exact = sessile_meridian(1e-9, np.radians(120), GAMMA, WEIGHT)
    assert abs(error(run.records[-1].height, exact.height)) < 0.01
    assert abs(error(fit_profile(flow.body.points, flow.body.triangles).max_width, exact.max_width)) < 0.01


@pytest.mark.parametrize(
    ("volume", "height", "width", "degrees"),
    [
        pytest.param(0.0141, 0.178, 0.400, 83, marks=pytest.mark.long),
        pytest.param(0.0564, 0.393, 0.495, 126, marks=pytest.mark.long),
        (0.1077, 0.523, 0.599, 138),
        pytest.param(0.1218, 0.550, 0.623, 140, marks=pytest.mark.long),
        pytest.param(0.2298, 0.707, 0.764, 148, marks=pytest.mark.long),
    ],
)
def test_five_volumes_on_a_pad(volume, height, width, degrees):
    """Hu et al. 4.2, pad radius 0.2 mm: caps pinned at the pad edge, the largest on the mask (closed form).

    The cube starts with its corners on the mask; the pad edge pins the contact line or is passed.
    """
    numerics = SolderNumerics(time_step_limit=100)
    solder = Solder(volume=volume * 1e-9, effects=SolderEffects(gravity="off"), numerics=numerics)
    flow, run = solve_drop(solder, 7, pad_radius=0.2e-3)
    assert run.records[-1].height == pytest.approx(height * 1e-3, rel=0.01)
    assert run.profiles[-1].max_width == pytest.approx(width * 1e-3, rel=5e-3)
    (wetting,) = flow.physics.events
    assert mean_angle(wetting.contact_cosines(flow.body)[0]) == pytest.approx(degrees, abs=2.0)
    assert verdict(flow.physics.lines, run.ruptured) == ("overflow" if degrees == 148 else "ok")


def test_solder_on_the_mask_meets_it_at_its_angle():
    """At a gap of 0.22 mm pinning would require 182 degrees; the solder flows over the edges to 148 degrees."""
    shape = solve_joint(JointGeometry(0.22e-3, RADIUS, RADIUS), Solder(volume=BALL))
    assert shape.verdict == "overflow"
    assert shape.metrics["contact_angle_board"][0] == pytest.approx(148.0, abs=1.0)
    assert abs(shape.metrics["width_error"][0]) < 5e-3
