"""The deflection that a plan expects, against exact responses and a run."""

from pathlib import Path

import numpy as np
import pytest

from reflowshock.workflow.board_drop.board_deflection import (
    SHARE,
    decided,
    expected_deflection,
    expected_peel,
    first_mode_peak,
)
from reflowshock.workflow.board_drop.shock_effects import shock_effects
from reflowshock.workflow.pipeline.reader import read_case

CASES = Path(__file__).parents[3] / "cases"
CASE = CASES / "bga_drop/case.toml"


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.45])
def test_a_half_sine_gives_its_shock_response(ratio):
    """Residual amplitude of a half sine A of duration T: q omega^2 / A = 4 r cos(pi r) / (1 - 4 r^2), r = f T."""
    peak, duration = 1.5e4, 5.0e-4
    omega = 2.0 * np.pi * ratio / duration

    def velocity(time: float) -> float:
        return peak * duration / np.pi * (1.0 - np.cos(np.pi * min(time, duration) / duration))

    exact = SHARE * peak / omega**2 * 4.0 * ratio * np.cos(np.pi * ratio) / (1.0 - 4.0 * ratio**2)
    assert first_mode_peak(omega, velocity, 40.0 * duration / ratio) == pytest.approx(exact, rel=0.01)


def test_the_default_board_deflects_about_as_far_as_its_run_found():
    deflection, slope, _ = expected_deflection(read_case(CASE, (), True))
    assert deflection == pytest.approx(7.6e-3, rel=0.25)  # cases/bga_drop
    assert slope == pytest.approx(np.pi / 0.19 * deflection)


def test_a_plan_reports_the_effect_of_small_kinematics():
    effect = shock_effects(read_case(CASE, (), True))["finite_rotation"]
    assert not effect["on"]
    assert "times its thickness" in effect["why"] and "shock.numerics.kinematics = finite" in effect["why"]
    finite = read_case(CASE, ["shock.numerics.kinematics=finite", "shock.coupling.scheme=held_velocity"], True)
    assert shock_effects(finite)["finite_rotation"]["on"]


def test_weight_bends_a_slow_board_by_more_than_g_over_the_peak():
    """Against a push of 2 A T / pi, much shorter than a swing: q = 4/pi g (1 - cos omega t) / omega^2 until the end."""
    case = read_case(CASE, (), True)
    omega, shock = expected_deflection(case).omega, case.shock
    left = shock.duration - 0.5 * shock.pulse_duration
    swing = 2.0 * shock.peak_acceleration * shock.pulse_duration / np.pi / omega * np.sin(omega * left)
    bent = 9.80665 * (1.0 - np.cos(omega * shock.duration)) / omega**2
    effect = shock_effects(case)["gravity_in_the_shock"]
    assert not effect["on"]
    assert effect["influence"] == pytest.approx(bent / swing, rel=0.02)
    assert effect["influence"] > 2.0 * 9.80665 / shock.peak_acceleration


def test_the_outermost_joints_bear_about_the_peel_stress_that_a_run_found():
    case = read_case(CASE, (), True)
    assert expected_peel(case, expected_deflection(case)) == pytest.approx(49.5e6, rel=0.3)  # cases/bga_drop


@pytest.mark.parametrize(
    ("solder", "switch", "pulse", "yields"),
    [
        ("SAC405", "auto", "B", True),
        ("SAC405", "auto", "F", False),
        ("SAC405", "off", "B", False),
        ("SAC405", "on", "F", True),
        ("SAC405_elastic", "on", "B", False),
    ],
)
def test_solder_yields_where_half_its_yield_stress_is_expected(solder, switch, pulse, yields):
    settings = [f"materials.solder={solder}", f"shock.numerics.plasticity={switch}", f"shock.service_condition={pulse}"]
    case = read_case(CASES / "jedec_bga/case.toml", ["scale=quick", *settings], True)
    effects = shock_effects(case)
    assert effects["plasticity"]["on"] == yields == (decided(case).materials.solder.plasticity is not None)
    assert effects["strain_rate"]["on"] == yields
    if solder == "SAC405":
        assert f"shock.numerics.plasticity = {switch}" in effects["plasticity"]["why"]
