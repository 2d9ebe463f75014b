"""Shock response spectrum: peak acceleration of damped single-degree-of-freedom oscillators under base excitation."""

import numpy as np
from numpy.typing import NDArray

QUALITY = 10.0  # Q = 1 / (2 zeta), usual in specifications
PER_OCTAVE = 12


def spectrum_frequencies(low: float, high: float) -> NDArray[np.float64]:
    """Return frequencies in a constant ratio, twelve per octave, in ascending order, shape (k,) [Hz].

    Args:
        low: First frequency [Hz].
        high: Largest frequency [Hz]; the last one may be slightly below it.
    """
    return low * 2.0 ** (np.arange(int(PER_OCTAVE * np.log2(high / low)) + 1) / PER_OCTAVE)


def response_spectrum(
    acceleration: NDArray[np.float64], step: float, frequencies: NDArray[np.float64], quality: float = QUALITY
) -> NDArray[np.float64]:
    """Compute the largest absolute acceleration of each oscillator, during the shock and after it.

    Ramp-invariant filters are exact for a base acceleration that is linear between samples (Smallwood, Shock and
    Vibration Bulletin 51, 1981). The base is at rest before the first sample and unaccelerated after the last.

    Args:
        acceleration: Acceleration of the base at equal steps, shape (n,) [m/s^2].
        step: Sampling step [s].
        frequencies: Undamped natural frequencies of the oscillators, shape (k,) [Hz].
        quality: Quality factor Q = 1 / (2 zeta), above 1/2.

    Returns:
        Peak absolute accelerations, shape (k,) [m/s^2].
    """
    from scipy.signal import lfilter

    ratio = 0.5 / quality
    peaks = np.empty(len(frequencies))
    for k, frequency in enumerate(frequencies):
        rest = np.zeros(int(np.ceil(1.0 / (frequency * step))) + 1)
        angle = 2.0 * np.pi * frequency * step
        decay, damped_angle = np.exp(-ratio * angle), angle * np.sqrt(1.0 - ratio**2)
        cosine, sine = decay * np.cos(damped_angle), decay * np.sin(damped_angle) / damped_angle
        response = lfilter(
            [1.0 - sine, 2.0 * (sine - cosine), decay**2 - sine],
            [1.0, -2.0 * cosine, decay**2],
            np.concatenate([acceleration, rest]),
        )
        peaks[k] = np.abs(response).max()
    return peaks
