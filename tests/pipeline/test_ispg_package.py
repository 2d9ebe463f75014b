"""Joints of a package by ISPG: each flows from its cone with inertia and rests in the shape of the default scheme."""

import json
import signal
from math import pi

import numpy as np
import pytest

from reflowshock.particles.scenes.products import read_shapes
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from tests.support.workflow_command import SMALL_CASE, break_off, command_line, reflowshock

SETTINGS = ("solder.numerics.scheme=ispg", "solder.effects.inertia=on")


def metrics_of(folder):
    """Return joint -> metric -> value, from the reflow in a run folder."""
    joints = json.loads((folder / "reflow/joints.json").read_text())
    return {name: {key: m["value"] for key, m in joint["metrics"].items()} for name, joint in joints.items()}


@pytest.fixture(scope="module")
def by_ispg(tmp_path_factory):
    """Return the run folder of a package whose joints flow by the scheme ispg."""
    folder = tmp_path_factory.mktemp("ispg")
    result = reflowshock("run", folder, "--until", "reflow", settings=SETTINGS)
    assert result.returncode == 0, result.stdout + result.stderr
    return folder


@pytest.mark.long
def test_tilted_joints_of_real_solder_rest_with_the_shapes_of_the_default(first_run, by_ispg):
    solder = read_case(SMALL_CASE).solder
    metrics, default = metrics_of(by_ispg), metrics_of(first_run[0])
    assert metrics.keys() == default.keys()
    for name, joint in metrics.items():
        assert joint["max_width"] == pytest.approx(default[name]["max_width"], rel=1e-4)
        change = joint["axial_force"] - default[name]["axial_force"]
        assert abs(change) < 1e-3 * pi * 0.24e-3 * solder.surface_tension
        assert joint["at_rest"] == 1.0 and joint["particles_lost"] == 0.0
        assert abs(joint["volume_drift"]) < 1e-9 and abs(joint["energy_imbalance"]) < 1e-6
    stage_metrics = json.loads((by_ispg / "reflow/stage.json").read_text())["metrics"]
    assert stage_metrics["joints_at_rest"]["value"] == len(metrics)


@pytest.mark.long  # joints one by one: tests/unit/particles/test_restart.py
def test_a_run_that_is_killed_goes_on_to_the_same_bits(by_ispg, tmp_path):
    line = command_line("run", tmp_path, "--until", "reflow", settings=SETTINGS)
    break_off(line, tmp_path, signal.SIGKILL, "stage")
    result = reflowshock("run", tmp_path, "--until", "reflow", settings=SETTINGS)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "continued from checkpoints" in " ".join(result.stdout.split())
    expected, actual = (read_shapes(run / "reflow/shapes.h5") for run in (by_ispg, tmp_path))
    assert actual.keys() == expected.keys()
    for name, shape in expected.items():
        for array in ("points", "velocity", "pressure"):
            assert np.array_equal(getattr(actual[name], array), getattr(shape, array))
        assert np.array_equal(actual[name].history["energy"], shape.history["energy"])


def test_the_plan_names_the_scheme_and_its_cost(tmp_path):
    plans = [json.loads(reflowshock("plan", tmp_path, "--json", settings=asked).stdout) for asked in (SETTINGS, ())]
    by_ispg, by_default = (plan["stages"]["reflow"]["seconds"] for plan in plans)
    assert by_ispg > by_default + 1.0
    assert "particles each, by ISPG" in reflowshock("plan", tmp_path, settings=SETTINGS).stdout


def test_it_is_the_default_with_inertia():
    def scheme(*settings):
        return read_case(SMALL_CASE, settings).solder.numerics.scheme

    assert (scheme(), scheme(SETTINGS[1])) == ("energy", "ispg")
    assert scheme(SETTINGS[1], "solder.numerics.scheme=energy") == "energy"
    assert scheme("solder.process_time=1 ms") == "ispg"
    assert scheme(SETTINGS[1], "solder.volume=0.26 mm^3") == "energy"


def test_joints_without_inertia_are_refused():
    with pytest.raises(CaseError, match="not verified for joints without inertia"):
        read_case(SMALL_CASE, SETTINGS[:1])


def test_joints_that_overflow_both_pads_are_refused():
    with pytest.raises(CaseError, match="not verified for joints that overflow both pads"):
        read_case(SMALL_CASE, (*SETTINGS, "solder.volume=0.26 mm^3"))
