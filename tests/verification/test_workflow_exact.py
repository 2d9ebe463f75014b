"""What is measured in a run of waves or of a cantilever is right where the motion is the exact one."""

import numpy as np
import pytest

from fem.materials.elasticity import elasticity_matrix
from fem.materials.parameters import Isotropic
from workflow.structure import exact_bar, exact_cantilever

BARS = exact_bar.Bars((0.1, 0.1), (70e9, 200e9), (2700.0, 8000.0), 8e-6)
HEIGHTS = [0.03, 0.05, 0.15]


def pulse(time: np.ndarray, middle: float) -> np.ndarray:
    phase = (time - middle) / BARS.pulse + 0.5
    return np.where((phase > 0.0) & (phase < 1.0), np.sin(np.pi * phase), 0.0)


def test_exact_waves_have_no_error():
    """D'Alembert: the pulse, its reflection and its transmission, each shifted in time."""
    time = np.linspace(0.0, 60e-6, 1501)
    low = [pulse(time, BARS.arrival(z)) + BARS.reflected * pulse(time, BARS.return_time(z)) for z in HEIGHTS[:2]]
    high = BARS.transmitted * pulse(time, BARS.arrival(HEIGHTS[2]))
    found = exact_bar.measure(BARS, time, [*low, high], HEIGHTS)
    assert found["wave_speed"] == pytest.approx(BARS.speeds[0], rel=1e-4)
    for name in ("wave_speed_error", "transmitted_velocity_error", "reflected_velocity_error"):
        assert abs(found[name]) < 5e-4


def test_energy_and_momentum_go_on_at_the_joint():
    lower, upper = BARS.impedances
    assert lower * (1.0 - BARS.reflected**2) == pytest.approx(upper * BARS.transmitted**2)
    assert lower * (1.0 - BARS.reflected) == pytest.approx(upper * BARS.transmitted)


def test_a_run_that_ends_before_the_wave_is_back_has_no_reflection():
    time = np.linspace(0.0, 20e-6, 501)
    found = exact_bar.measure(BARS, time, [pulse(time, BARS.arrival(z)) for z in HEIGHTS], HEIGHTS)
    assert np.isnan(found["reflected_velocity_error"])


def modal_tip(strip: exact_cantilever.Strip, time: np.ndarray, modes: int = 12) -> np.ndarray:
    """Tip of an Euler-Bernoulli cantilever under sudden uniform pressure, by its modes on a fine grid."""
    x = np.linspace(0.0, 1.0, 4001)
    tip = np.zeros_like(time)
    for n in range(modes):
        root = exact_cantilever.ROOTS[n] if n < 3 else (n + 0.5) * np.pi
        ratio = (np.cosh(root) + np.cos(root)) / (np.sinh(root) + np.sin(root))
        shape = np.cosh(root * x) - np.cos(root * x) - ratio * (np.sinh(root * x) - np.sin(root * x))
        omega = 2.0 * np.pi * strip.frequency * (root / exact_cantilever.ROOTS[0]) ** 2
        static = (
            strip.pressure * np.trapz(shape, x) / np.trapz(shape**2, x) / (strip.density * strip.thickness * omega**2)
        )
        tip += static * shape[-1] * (1.0 - np.cos(omega * time))
    return tip


def test_an_exact_cantilever_has_no_error():
    elasticity = elasticity_matrix(Isotropic(density=2700.0, young_modulus=70e9, poisson_ratio=0.3))
    strip = exact_cantilever.Strip(0.1, 1e-3, elasticity, 2700.0, 100.0)
    assert strip.stiffness == pytest.approx(70e9 / 0.91 * 1e-9 / 12.0)
    time = np.linspace(0.0, 1.1 / strip.frequency, 800)
    found = exact_cantilever.measure(strip, time, -modal_tip(strip, time))
    assert found["tip_deflection"] == pytest.approx(strip.deflection, rel=1e-3)
    assert found["swing_frequency"] == pytest.approx(strip.frequency, rel=1e-3)
