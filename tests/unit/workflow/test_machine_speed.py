"""Measured slowness of a machine, its file, and its use in forecasts."""

import json

import pytest

from reflowshock.kernel_cache import VARIABLE
from reflowshock.workflow.kinds import every_stage
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.process import machine_speed
from reflowshock.workflow.process.machine_speed import FILE, IDLE, LONG, MachineSpeed, measure_after, slowness
from tests.support.workflow_command import SMALL_CASE

RECORD = {"slowness": 2.0, "families": {"turning": 2.0}, "date": "2026-01-01", "busy": 0.0}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder of kernels without a measurement."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    return tmp_path


@pytest.fixture
def calibrations(monkeypatch):
    """Replace the measurement by two families with slowness 1 and 4; return the list of its calls."""
    calls = []

    def run(command, **options):
        calls.append(command)
        return type("Done", (), {"stdout": json.dumps({"box": 1.0, "turning": 4.0})})

    monkeypatch.setattr(machine_speed.subprocess, "run", run)
    return calls


def test_forecasts_of_a_shock_follow_the_measured_slowness(folder):
    case = read_case(SMALL_CASE)
    assert slowness() == 1.0
    before = every_stage(case, {"shock": 10.0, "reflow": 5.0})
    (folder / FILE).write_text(json.dumps(RECORD))
    after = every_stage(case, {"shock": 10.0, "reflow": 5.0})
    assert after == before | {"shock": 20.0}


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"slowness": 2}'])
def test_a_damaged_file_counts_as_no_measurement(folder, text):
    (folder / FILE).write_text(text)
    assert slowness() == 1.0


def test_a_machine_is_measured_once_after_a_long_shock(folder, calibrations):
    measure_after(0.5 * LONG)
    assert not calibrations
    measure_after(2.0 * LONG)
    assert slowness() == pytest.approx(2.0)
    (folder / FILE).write_text(json.dumps(RECORD))
    measure_after(2.0 * LONG)
    assert len(calibrations) == 1


def test_a_measurement_beside_other_work_is_repeated(folder, calibrations):
    (folder / FILE).write_text(json.dumps(RECORD | {"busy": 2.0 * IDLE}))
    measure_after(2.0 * LONG)
    assert len(calibrations) == 1


def test_a_measurement_that_fails_leaves_the_reference_machine(folder, monkeypatch):
    def fail(command, **options):
        raise OSError

    monkeypatch.setattr(machine_speed.subprocess, "run", fail)
    measure_after(2.0 * LONG)
    assert slowness() == 1.0 and not (folder / FILE).exists()


def test_other_work_is_told():
    assert "other work" not in MachineSpeed(**RECORD).in_words()
    assert "beside other work on 1.5 cores" in MachineSpeed(**RECORD | {"busy": 1.5}).in_words()
