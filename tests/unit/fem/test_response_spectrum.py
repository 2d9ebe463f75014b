"""The shock response spectrum against exact spectra and the convolution integral."""

import numpy as np
import pytest

from reflowshock.fem.output.response_spectrum import response_spectrum, spectrum_frequencies

STEP = 1e-5


def test_half_sine_without_damping():
    """Peak after the pulse, |2 r cos(pi r) ...|: 2 (f/f0) cos(pi f/(2 f0) ...) for masses slower than the pulse.

    With r = f T2, T2 the pulse's full period: A 2 r |cos(pi r / 2)| / |1 - r^2|, r = 2 f T < 1 of a pulse of length T.
    """
    length = 1e-2
    pulse = np.sin(np.pi * np.arange(int(length / STEP) + 1) * STEP / length)
    ratio = np.array([0.2, 0.5, 0.8])  # 2 f T
    spectrum = response_spectrum(pulse, STEP, ratio / (2 * length), quality=1e6)
    exact = 2.0 * ratio * np.cos(np.pi * ratio / 2) / (1.0 - ratio**2)
    assert spectrum == pytest.approx(exact, rel=1e-3)


def test_step_overshoots_by_its_damping():
    quality, frequency = 10.0, np.array([100.0])
    spectrum = response_spectrum(np.ones(4000), STEP, frequency, quality)
    ratio = 0.5 / quality
    rate = 2 * np.pi * frequency[0]
    time = np.arange(4000) * STEP
    damped = rate * np.sqrt(1 - ratio**2)
    displacement = (
        -(1 - np.exp(-ratio * rate * time) * (np.cos(damped * time) + ratio * rate / damped * np.sin(damped * time)))
        / rate**2
    )
    velocity = -np.exp(-ratio * rate * time) * np.sin(damped * time) / damped
    exact = np.abs(2 * ratio * rate * velocity + rate**2 * displacement).max()
    assert spectrum[0] == pytest.approx(exact, rel=1e-2)  # the record begins within a step


def test_record_of_ramps_against_the_convolution_integral():
    rng = np.random.default_rng(7)
    coarse = np.concatenate([[0.0], rng.normal(size=30), [0.0]])
    frequency, quality = 200.0, 10.0
    ratio, rate = 0.5 / quality, 2 * np.pi * frequency
    step, fine = 2e-4, 2e-7
    times = np.arange(0.0, 31 * step + 1.0 / frequency, fine)
    base = np.interp(times, np.arange(32) * step, coarse, right=0.0)
    damped = rate * np.sqrt(1 - ratio**2)
    decay = np.exp(-ratio * rate * times)
    kernel = decay * (
        2 * ratio * rate * np.cos(damped * times)
        + (rate**2 - 2 * (ratio * rate) ** 2) / damped * np.sin(damped * times)
    )
    size = 2 * len(times)
    exact = fine * np.fft.irfft(np.fft.rfft(base, size) * np.fft.rfft(kernel, size), size)[: len(times)]
    at_samples = np.abs(exact[:: round(step / fine)]).max()
    assert response_spectrum(coarse, step, np.array([frequency]), quality)[0] == pytest.approx(at_samples, rel=1e-3)


def test_stiff_masses_follow_the_base_and_soft_ones_stay():
    pulse = np.sin(np.pi * np.arange(1001) / 1000)  # 10 ms
    low, high = response_spectrum(pulse, STEP, np.array([0.1, 5000.0]))
    assert high == pytest.approx(1.0, rel=0.01) and low < 0.01


def test_twelve_frequencies_an_octave():
    frequencies = spectrum_frequencies(100.0, 401.0)
    assert len(frequencies) == 25 and frequencies[[0, 12, 24]] == pytest.approx([100.0, 200.0, 400.0])
