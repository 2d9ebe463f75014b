"""Flows by delta-SPH: cases, forecasts and plans; refused with key, value and range where they cannot be."""

from pathlib import Path

import pytest

from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.fluid.forecast import forecast_flow, time_step
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.pipeline.reader import read_case

CASES = Path(__file__).resolve().parents[3] / "cases"
DAM, CHANNEL, VORTICES = (CASES / name / "case.toml" for name in ("dam_break", "poiseuille", "taylor_green"))
BAD_VALUES = {
    "no room": (DAM, "dam_break.width=3.3 m", ["dam_break.tank_length", '"3.22 m"', "> dam_break.width = 3.3 m"]),
    "thin column": (DAM, "dam_break.width=1 mm", ["dam_break.width", "less than one particle", ">= 0.01 m"]),
    "sensor in the air": (DAM, "dam_break.sensor_height=3 m", ["dam_break.sensor_height", "<= 2.4 m"]),
    "coarse": (DAM, "dam_break.numerics.particles_across=4", ["particles_across = 4", ">= 8"]),
    "slow sound": (DAM, "dam_break.numerics.sound_speed=2", ["sound_speed = 2", ">= 5"]),
    "no kernel": (
        DAM,
        "dam_break.numerics.kernel=wenland",
        ["one of cubic_spline, wendland", "did you mean wendland?"],
    ),
    "a height in seconds": (DAM, "dam_break.height=1 s", ["dam_break.height", "expected a length"]),
    "negative speed": (CHANNEL, "poiseuille.speed=-1 m/s", ["poiseuille.speed", "> 0"]),
    "turbulent": (
        CHANNEL,
        "poiseuille.speed=10 m/s",
        ["poiseuille.viscosity", "Reynolds number 1e+04", ">= 0.01 Pa*s"],
    ),
    "without viscosity": (VORTICES, "taylor_green.effects.viscosity=off", ["effects.viscosity", "auto, on"]),
    "unknown key": (VORTICES, "taylor_green.sides=1 mm", ["taylor_green.sides", "unknown key", "side"]),
}


@pytest.mark.parametrize(("path", "setting", "words"), BAD_VALUES.values(), ids=BAD_VALUES.keys())
def test_what_cannot_be_is_refused_in_words(path, setting, words):
    with pytest.raises(CaseError) as caught:
        read_case(path, [setting], True)
    assert all(word in str(caught.value) for word in words), str(caught.value)


@pytest.mark.parametrize("path", [DAM, CHANNEL, VORTICES], ids=["dam", "channel", "vortices"])
def test_plans_tell_particles_steps_and_cost(path):
    case = read_case(path, [], True)
    outlook = forecast_flow(case)
    assert outlook.particles == case.scene.particles
    assert outlook.steps * outlook.time_step >= case.scene.until
    assert outlook.seconds["particles"] > 0.0
    assert kind_of(case).size(case).memory > 0.0
    study = kind_of(case).study(case)
    assert {run.parameter for run in study.runs} == {"particle spacing", "smoothing length"}


def test_viscosity_limits_the_step_of_fine_flows():
    scene = read_case(CHANNEL, ["poiseuille.numerics.particles_across=200"], True).scene
    assert time_step(scene, True) < time_step(scene, False)
