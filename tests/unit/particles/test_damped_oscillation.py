"""Frequency and decay fitted to exact damped oscillations."""

import numpy as np
import pytest

from reflowshock.particles.scenes.free_drop import fit_oscillation

TIME = np.linspace(0.0, 3.0, 200)


def swing(frequency, harmonic=0.1):
    """Return a damped oscillation with its harmonic at ``TIME``, shape (n,)."""
    decay, angle = np.exp(-0.2 * TIME), frequency * TIME
    return 0.05 + decay * np.cos(angle + 0.3) + harmonic * decay**2 * np.cos(2.0 * angle)


@pytest.mark.parametrize("guess", [5.4, 6.0, 6.6])
def test_fundamental_beside_its_harmonic(guess):
    assert fit_oscillation(TIME, swing(6.0), guess) == pytest.approx((0.2, 6.0), rel=1e-6)


def test_an_octave_is_no_harmonic():
    assert fit_oscillation(TIME, swing(12.0), 6.0) == pytest.approx((0.2, 12.0), rel=1e-6)
