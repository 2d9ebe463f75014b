"""Frequency and decay rate of a weakly nonlinear damped oscillation, from samples."""

import numpy as np
from scipy.optimize import least_squares

from reflowshock.arrays import Floats


def fit_oscillation(time: Floats, values: Floats, frequency: float) -> tuple[float, float]:
    """Fit decay rate [1/s] and angular frequency [rad/s] of the fundamental.

    Model: exp(-b t) cos(w t + ..), and of second order its harmonic exp(-2 b t) cos(2 w t + ..), its mean exp(-2 b t)
    and a constant. The factors of these are linear and eliminated (variable projection).

    Args:
        time: `(k,)` [s], more than a period.
        values: `(k,)`.
        frequency: a guess within some 20 % [rad/s]; an octave too low is noticed: the harmonic is then the larger one.
    """

    def columns(unknowns: Floats) -> Floats:
        decay, angle = np.exp(-unknowns[0] * scaled), unknowns[1] * scaled
        first, second = decay * np.exp(1j * angle), decay**2 * np.exp(2j * angle)
        return np.column_stack((first.real, first.imag, second.real, second.imag, decay**2, np.ones_like(decay)))

    def factors(basis: Floats) -> Floats:
        return np.linalg.lstsq(basis, values, rcond=None)[0]

    def misfit(unknowns: Floats) -> Floats:
        basis = columns(unknowns)
        return basis @ factors(basis) - values

    scaled = time * frequency
    found = least_squares(misfit, (0.01, 1.0), x_scale=(0.01, 0.01), xtol=1e-12, ftol=1e-12).x
    first, second = np.hypot(*factors(columns(found))[:4].reshape(2, 2).T)
    if second > first:
        return fit_oscillation(time, values, 2.0 * frequency)
    return found[0] * frequency, found[1] * frequency
