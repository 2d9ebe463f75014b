"""Measured strip at the quick scale: its records, and the run against the record that was not fitted."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, hilbert, sosfiltfilt

from reflowshock.fem.loads.pulse import STANDARD_GRAVITY
from reflowshock.fem.loads.pulse_table import read_pulse
from reflowshock.fem.output.acceleration import Acceleration, apply_low_pass
from reflowshock.fem.problem.filters import LowPass
from tests.support.warm_start import warm_command

STRIP = Path(__file__).resolve().parents[2] / "cases" / "measured_strip"
QUICK = (
    "structure.cells=[24,4]", "dynamics.duration=2.4 ms", "dynamics.modes=4", "dynamics.numerics.implicit_step=10 us",
    "dynamics.numerics.history_samples=240", "dynamics.numerics.field_samples=2",
)  # fmt: skip


def record(impact: str, column: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and accelerations [m/s^2] of a measured impact."""
    pulse = read_pulse(STRIP / "data" / f"board4_4_impact{impact}.csv", "acceleration", column)
    return pulse.times, pulse.values


def filtered(impact: str) -> Acceleration:
    """Return the acceleration of the board in a measured impact, after the low-pass filter."""
    times, values = record(impact, "board_g")
    return Acceleration(times, values, apply_low_pass(values, times[1] - times[0], LowPass()))


def test_first_frequency_and_damping_of_the_record():
    """Phase and decay of the first mode of the fitted impact, from 4 to 8 ms after the trigger."""
    times, values = record("02", "board_g")
    band = sosfiltfilt(butter(3, (500.0, 1200.0), "bandpass", fs=2e5, output="sos"), values)
    signal, late = hilbert(band), (times > 4.5e-3) & (times < 8.5e-3)
    frequency = np.polyfit(times[late], np.unwrap(np.angle(signal))[late], 1)[0] / (2 * np.pi)
    decay = -np.polyfit(times[late], np.log(np.abs(signal))[late], 1)[0]
    assert frequency == pytest.approx(784.8, abs=1.0)
    assert decay / (2 * np.pi * frequency) == pytest.approx(0.0153, abs=0.001)


@pytest.mark.parametrize(("impact", "peaks"), [("02", (2886.0, 2790.0)), ("03", (2881.0, 2779.0))])
def test_peaks_of_the_records_after_cfc_1000(impact, peaks):
    assert list(filtered(impact).peaks_in_g("board").values()) == pytest.approx(peaks, rel=1e-3)


@pytest.mark.long
def test_impact_that_was_not_fitted(tmp_path):
    """The limits of the case: f1 within 5 %, first peak within 20 %, second within 10 % of the measured ones."""
    settings = [item for setting in QUICK for item in ("--set", setting)]
    done = warm_command("run", str(STRIP / "case.toml"), "--out", str(tmp_path), "--until", "shock", *settings)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((tmp_path / "shock" / "implicit" / "result.json").read_text())
    metrics = {name: metric["value"] for name, metric in result["metrics"].items()}
    assert metrics["first_frequency"] == pytest.approx(784.8, rel=0.05)
    first, second = filtered("03").peaks_in_g("centre").items()
    assert metrics[first[0]] == pytest.approx(first[1], rel=0.2)
    assert metrics[second[0]] == pytest.approx(second[1], rel=0.1)
    assert metrics["acceleration_filter"].startswith("CFC 1000, -3 dB at 1667 Hz")
    assert result["metrics"][first[0]]["unit"] == "G"


def test_record_is_moved_to_the_start_and_keeps_its_velocity():
    times, values = record("03", "input_g")
    assert times[0] == 0.0
    assert values.max() / STANDARD_GRAVITY == pytest.approx(5277.0, rel=1e-3)
    velocity = 0.5 * np.sum((values[1:] + values[:-1]) * np.diff(times))
    assert velocity == pytest.approx(4.78, abs=0.05)
