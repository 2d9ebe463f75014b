"""Accelerations from histories and their filter: frequency response, SAE J211 recursion and invalid settings."""

import numpy as np
import pytest
from pydantic import ValidationError

from reflowshock.fem.loads.pulse import STANDARD_GRAVITY, HalfSine
from reflowshock.fem.output.acceleration import (
    Acceleration,
    acceleration,
    apply_low_pass,
    drop_accelerations,
    is_sampled,
    watch_accelerations,
)
from reflowshock.fem.problem.attachment_checks import filter_problems
from reflowshock.fem.problem.filters import LowPass
from reflowshock.fem.problem.fittings import WatchPoint
from reflowshock.fem.problem.structure import StructureProblem
from tests.support.fem_structures import structure_tables_of

STEP = 1e-5
TIME = np.arange(4000) * STEP


def j211(values: np.ndarray, step: float, channel_class: float) -> np.ndarray:
    """Apply the SAE J211-1 recursion in both directions to a record with zeros beyond its ends."""
    analogue = np.tan(np.pi * channel_class * 2.0775 * step)
    scale = 1.0 + np.sqrt(2.0) * analogue + analogue**2
    a0, b1, b2 = (
        analogue**2 / scale,
        -2.0 * (analogue**2 - 1.0) / scale,
        (-1.0 + np.sqrt(2.0) * analogue - analogue**2) / scale,
    )
    for _ in range(2):
        out = np.zeros_like(values)
        for k in range(len(values)):
            x = [values[k - j] if k >= j else 0.0 for j in range(3)]
            y = [out[k - j] if k >= j else 0.0 for j in (1, 2)]
            out[k] = a0 * (x[0] + 2.0 * x[1] + x[2]) + b1 * y[0] + b2 * y[1]
        values = out[::-1]
    return values


@pytest.mark.parametrize("channel_class", [60, 180, 600, 1000])
def test_channel_frequency_classes_are_those_of_sae_j211(channel_class):
    pulse = np.exp(-(((TIME - 0.02) / 2e-4) ** 2)) * np.cos(8e3 * TIME)
    expected = j211(pulse, STEP, channel_class)
    filtered = apply_low_pass(pulse, STEP, LowPass(channel_class=channel_class))
    inner = slice(500, 3500)  # they treat the ends differently
    assert np.abs(filtered - expected)[inner].max() <= 1e-6 * np.abs(expected).max()


FILTERS = [
    LowPass(),
    LowPass(channel_class=180),
    *(LowPass(kind="butterworth", corner=2e3, order=n) for n in (1, 2, 4)),
]


@pytest.mark.parametrize("low_pass", FILTERS, ids=lambda item: item.label)
@pytest.mark.parametrize("ratio", [0.25, 1.0, 2.0])
def test_frequency_response(low_pass, ratio):
    """Both passes give 1 / (1 + (s f / fc)^2n), s^2n = sqrt(2) - 1: -3 dB at the corner without phase shift."""
    order, _ = low_pass.passes
    frequency = ratio * low_pass.frequency
    response = apply_low_pass(np.sin(2 * np.pi * frequency * TIME), 1e-5, low_pass)[1500:2500]
    expected = (
        1.0 / (1.0 + (np.sqrt(2.0) - 1.0) * ratio ** (2 * order)) * np.sin(2 * np.pi * frequency * TIME[1500:2500])
    )
    assert np.abs(response - expected).max() < 0.02  # of the bilinear transform


def test_corners_are_told():
    assert LowPass().label == "CFC 1000, -3 dB at 1667 Hz"
    assert "order 2 x 3, -3 dB at 500 Hz" in LowPass(kind="butterworth", corner=500.0, order=3).label


def test_acceleration_of_a_swing_and_its_two_peaks():
    """For x = t^2 sin(w t) differences have the error (w dt)^2 / 12, and a filter far above w has no effect."""
    rate = 2 * np.pi * 50.0
    displacement = 1e-3 * np.sin(rate * TIME) * np.exp(-rate * 0.05 * TIME)
    values = acceleration(TIME, displacement, LowPass())
    exact = 1e-3 * np.imag((1j - 0.05) ** 2 * rate**2 * np.exp((1j - 0.05) * rate * TIME))[1:-1]
    assert np.abs(values.raw - exact).max() < 1e-4 * np.abs(exact).max()
    inner = slice(200, -200)
    assert np.abs(values.filtered - exact)[inner].max() < 1e-3 * np.abs(exact).max()


def test_second_peak_has_the_other_sign_and_comes_later():
    values = np.array([0.0, 6.0, -9.0, 3.0, -8.0, 5.0]) * STANDARD_GRAVITY
    course = Acceleration(np.arange(6.0), values, values)
    assert course.peaks == (2, 5)
    assert course.peaks_in_g("lid") == {
        "peak_acceleration@lid": pytest.approx(9.0),
        "second_peak_acceleration@lid": pytest.approx(5.0),
    }
    assert Acceleration(np.arange(3.0), -values[:3], -abs(values[:3])).peaks_in_g("lid")[
        "second_peak_acceleration@lid"
    ] == pytest.approx(0.0)


def test_watch_point_at_rest_on_the_table_feels_the_table():
    """A point at rest in the table frame has the acceleration of the table, along the direction of the point."""
    peak, duration = 1000.0, 0.01
    tables = structure_tables_of(
        loads={"drop": {"kind": "input_g", "peak": peak, "duration": duration, "direction": [0.0, 0.0, -2.0]}},
        watch={"foot": {"at": [0.0, 0.0, 0.0]}, "aslant": {"at": [0.0, 0.0, 0.0], "direction": [0.0, 3.0, 4.0]}},
    )
    problem = StructureProblem(**{name: tables[name] for name in StructureProblem.model_fields if name in tables})
    rest = {f"displacement@{name}": np.zeros((len(TIME), 3)) for name in problem.watch}
    accelerations = watch_accelerations({"time": TIME} | rest, problem, {"drop": HalfSine(peak, duration)})
    assert accelerations["foot"].raw.max() == pytest.approx(peak, rel=1e-5)
    assert accelerations["aslant"].raw.min() == pytest.approx(-0.8 * peak, rel=1e-5)
    assert watch_accelerations({"time": TIME[::100]}, problem, {}) == {}


def test_package_and_board_at_rest_on_the_table_feel_the_table():
    rest = np.zeros((len(TIME), 3))
    watch = {
        "foot": WatchPoint(at=(0.0, 0.0, 0.0)),
        "aslant": WatchPoint(at=(0.0, 0.0, 0.0), direction=(3.0, 0.0, 4.0)),
    }
    arrays = {"time": TIME, "die_centre": rest + [1e-12, 0.0, 0.0]} | {f"displacement@{name}": rest for name in watch}
    accelerations = drop_accelerations(arrays, HalfSine(5000.0, 0.01), LowPass(), watch)
    for name in ("package", "foot"):
        assert accelerations[name].raw.max() == pytest.approx(5000.0, rel=1e-5)
        assert accelerations[name].filtered.max() == pytest.approx(5000.0, rel=2e-3)
    assert accelerations["aslant"].raw.min() == pytest.approx(-0.8 * 5000.0, rel=1e-5)
    assert list(drop_accelerations(arrays | {"die_centre": rest}, HalfSine(1.0, 1.0), LowPass(), watch)) == list(watch)
    assert drop_accelerations({"time": TIME[::100]}, HalfSine(1.0, 1.0), LowPass(), {}) == {}


def test_too_few_samples():
    assert is_sampled(TIME, LowPass()) and not is_sampled(TIME[::10], LowPass())
    with pytest.raises(ValueError, match="1000 samples per second are too few for a filter with CFC 1000"):
        apply_low_pass(np.zeros(100), 1e-3, LowPass())


@pytest.mark.parametrize(
    ("parameters", "key", "message"),
    [
        ({"kind": "butterworth"}, "dynamics.filter.corner", "is missing"),
        ({"corner": 500.0}, "dynamics.filter.corner", "kind = butterworth"),
        ({"channel_class": 10_000}, "dynamics.numerics.history_samples", "CFC 10000, -3 dB at 1.667e"),
    ],
)
def test_filter_that_does_not_fit(parameters, key, message):
    [problem] = filter_problems("dynamics", LowPass(**parameters), 1e-2, 600)
    assert problem.key == key and message in str(problem)


@pytest.mark.parametrize("parameters", [{"channel_class": 0.0}, {"kind": "bessel"}, {"order": 9}, {"corner": -1.0}])
def test_filter_out_of_range(parameters):
    with pytest.raises(ValidationError):
        LowPass(**parameters)
