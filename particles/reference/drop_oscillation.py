"""Small oscillations of a free drop: Rayleigh's frequency, Lamb's damping, both at any viscosity, a fit."""

from cmath import sqrt as complex_sqrt
from math import sqrt

import numpy as np
from scipy.optimize import least_squares, newton
from scipy.special import jve

from reflowshock.arrays import Floats


def rayleigh_frequency(mode: int, radius: float, density: float, surface_tension: float) -> float:
    """Angular frequency without viscosity, omega^2 = n (n - 1)(n + 2) gamma / (rho R^3) [rad/s]."""
    return sqrt(mode * (mode - 1) * (mode + 2) * surface_tension / (density * radius**3))


def lamb_decay_rate(mode: int, radius: float, density: float, viscosity: float) -> float:
    """Decay rate of the amplitude at small viscosity, (n - 1)(2 n + 1) mu / (rho R^2) [1/s]."""
    return (mode - 1) * (2 * mode + 1) * viscosity / (density * radius**2)


def viscous_oscillation(mode: int, frequency: float, diffusion_rate: float) -> tuple[float, float]:
    """Decay rate [1/s] and angular frequency [rad/s] of a mode at any viscosity that lets it oscillate.

    Amplitude exp(-s t) with s = decay + i frequency solves, with q^2 = s / nu* and Q = J_{n+3/2}(q) / J_{n+1/2}(q),
    omega^2 / nu*^2 = 2 q^2 (n - 1) (n + (n + 1)(q - 2 n Q) / (q - 2 Q)) - q^4 (Chandrasekhar 1959; Reid 1960).

    Args:
        mode: n.
        frequency: Rayleigh's omega [rad/s].
        diffusion_rate: nu* = mu / (rho R^2) [1/s].
    """
    ratio = (frequency / diffusion_rate) ** 2

    def residual(s: complex) -> complex:
        q = complex_sqrt(s)
        quotient = jve(mode + 1.5, q) / jve(mode + 0.5, q)
        inner = mode + (mode + 1) * (q - 2 * mode * quotient) / (q - 2 * quotient)
        return (2 * s * (mode - 1) * inner - s**2) / ratio - 1.0

    first = (mode - 1) * (2 * mode + 1) + 1j * sqrt(ratio)
    root = newton(residual, first, x1=first * (0.99 + 0.01j)) * diffusion_rate
    return root.real, root.imag


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
