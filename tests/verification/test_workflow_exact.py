"""Error measures of wave and cantilever runs vanish for the exact motion."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from reflowshock.fem.loads.pulse import HalfSine, Haversine
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.parameters import Isotropic
from reflowshock.workflow.structure import exact_bar, exact_cantilever, exact_layers

BARS = exact_bar.Bars((0.1, 0.1), (70e9, 200e9), (2700.0, 8000.0), 8e-6)
HEIGHTS = [0.03, 0.05, 0.15]


def pulse(time: np.ndarray, middle: float) -> np.ndarray:
    """Return a half sine about a middle time [s], shaped as ``time``."""
    phase = (time - middle) / BARS.pulse + 0.5
    return np.where((phase > 0.0) & (phase < 1.0), np.sin(np.pi * phase), 0.0)


def test_exact_waves_have_no_error():
    """D'Alembert's solution has the incident, reflected and transmitted pulse, each shifted in time."""
    time = np.linspace(0.0, 60e-6, 1501)
    low = [pulse(time, BARS.arrival(z)) + BARS.reflected * pulse(time, BARS.return_time(z)) for z in HEIGHTS[:2]]
    high = BARS.transmitted * pulse(time, BARS.arrival(HEIGHTS[2]))
    errors = exact_bar.measure(BARS, time, [*low, high], HEIGHTS)
    assert errors["wave_speed"] == pytest.approx(BARS.speeds[0], rel=1e-4)
    for name in ("wave_speed_error", "transmitted_velocity_error", "reflected_velocity_error"):
        assert abs(errors[name]) < 5e-4


def test_energy_and_momentum_are_continuous_at_the_joint():
    lower, upper = BARS.impedances
    assert lower * (1.0 - BARS.reflected**2) == pytest.approx(upper * BARS.transmitted**2)
    assert lower * (1.0 - BARS.reflected) == pytest.approx(upper * BARS.transmitted)


def test_run_that_ends_before_the_reflection_reports_nan():
    time = np.linspace(0.0, 20e-6, 501)
    errors = exact_bar.measure(BARS, time, [pulse(time, BARS.arrival(z)) for z in HEIGHTS], HEIGHTS)
    assert np.isnan(errors["reflected_velocity_error"])


def test_rays_through_layers_match_two_bars_and_conserve_energy():
    layers = exact_layers.Layers(BARS.lengths, (70e9, 200e9), (2700.0, 8000.0))
    time = np.linspace(0.0, 55e-6, 1376)
    low = pulse(time, BARS.arrival(0.05)) + BARS.reflected * pulse(time, BARS.return_time(0.05))
    low += BARS.reflected * pulse(time, BARS.return_time(0.0) + 0.05 / BARS.speeds[0])
    shape = HalfSine(BARS.impedances[0], BARS.pulse).value
    assert np.abs(layers.velocity(0.05, time, shape) - low).max() < 1e-6


def test_thin_section_reflects_as_its_transfer_matrix():
    """The transmission through a section of different impedance follows Brekhovskikh (1980, 2.5) per frequency."""
    layers = exact_layers.Layers((0.5, 2e-3, 1.0), (20e9, 60e9, 20e9), (2000.0, 8000.0, 2000.0))
    duration, count = 300e-6, 6000
    time = np.arange(count) * duration / count

    shape = Haversine(1.0, 20e-6).value
    stress = layers.velocity(0.6, time, shape) * layers.impedances[0]
    z1, z2 = layers.impedances[:2]
    omega = 2.0 * np.pi * np.fft.rfftfreq(count, duration / count)
    across = omega * 2e-3 / layers.speeds[1]
    passed = 1.0 / (np.cos(across) + 0.5j * (z1 / z2 + z2 / z1) * np.sin(across))
    delay = np.exp(-1j * omega * (0.6 - 2e-3) / layers.speeds[0])
    exact = np.fft.irfft(np.fft.rfft([shape(t) for t in time]) * passed * delay, count)
    early = time < 0.5 / layers.speeds[0] + 0.5 * 20e-6 + 60e-6
    assert np.abs(stress - exact)[early].max() < 2e-4 * exact.max()


def test_exact_waves_through_layers_have_no_error():
    layers = exact_layers.Layers((0.1, 4e-3, 0.1), (70e9, 200e9, 70e9), (2700.0, 8000.0, 2700.0))
    heights = {"near": 0.03, "far": 0.05, "beyond": 0.15}
    time, shape = np.linspace(0.0, 55e-6, 1376), exact_layers.Pulse(HalfSine(1e6, 8e-6).value, 8e-6)
    history = {name: layers.velocity(height, time, shape.value) for name, height in heights.items()}
    errors = exact_layers.measure(layers, shape, heights, history | {"time": time})
    assert errors["wave_speed_error"] == pytest.approx(0.0, abs=5e-4)
    assert errors["transmitted_velocity_error"] == errors["reflected_velocity_error"] == errors["wave_error"] == 0.0
    assert 0.3 < errors["reflected_velocity"] < 0.35 and 0.8 < errors["transmitted_velocity"] < 1.0


def modal_tip(strip: exact_cantilever.Strip, time: np.ndarray, modes: int = 12) -> np.ndarray:
    """Return the tip motion of an Euler-Bernoulli cantilever under sudden uniform pressure by modal superposition."""
    x = np.linspace(0.0, 1.0, 4001)
    tip = np.zeros_like(time)
    for n in range(modes):
        root = exact_cantilever.ROOTS[n] if n < 3 else (n + 0.5) * np.pi
        ratio = (np.cosh(root) + np.cos(root)) / (np.sinh(root) + np.sin(root))
        shape = np.cosh(root * x) - np.cos(root * x) - ratio * (np.sinh(root * x) - np.sin(root * x))
        omega = 2.0 * np.pi * strip.frequency * (root / exact_cantilever.ROOTS[0]) ** 2
        static = (
            strip.pressure * trapezoid(shape, x) / trapezoid(shape**2, x) / (strip.density * strip.thickness * omega**2)
        )
        tip += static * shape[-1] * (1.0 - np.cos(omega * time))
    return tip


def test_an_exact_cantilever_has_no_error():
    elasticity = elasticity_matrix(Isotropic(density=2700.0, young_modulus=70e9, poisson_ratio=0.3))
    strip = exact_cantilever.Strip(0.1, 1e-3, elasticity, 2700.0, 100.0)
    assert strip.stiffness == pytest.approx(70e9 / 0.91 * 1e-9 / 12.0)
    time = np.linspace(0.0, 1.1 / strip.frequency, 800)
    errors = exact_cantilever.measure(strip, time, -modal_tip(strip, time))
    assert errors["tip_deflection"] == pytest.approx(strip.deflection, rel=1e-3)
    assert errors["swing_frequency"] == pytest.approx(strip.frequency, rel=1e-3)
