"""Numba kernels of J2 plasticity: the return equation of one point, with hardening, rate and temperature.

The yield stress is that of Johnson and Cook (``materials.parameters.JohnsonCook``). Its rate factor is the classical
1 + C ln max(1, r) and not the smooth 1 + C ln(1 + r): published constants are fitted to it, and the smooth one lifts
the yield stress at the reference rate, where A and B are measured, by C ln 2.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.fem.kernels.hexahedron import FINITE
from reflowshock.fem.materials.parameters import Isotropic, Material

NEVER_YIELDS = np.array([1.0, np.inf, 0.0, 1.0, 0.0, 1.0])  # ``plastic_constants`` of what stays elastic
FIRST_YIELD = 1  # column of the yield stress at no plastic strain, infinite where a material never yields
ITERATIONS = 100  # far more than any admissible constants need; typical are 2
CONVERGED = 1e-7  # relative correction after which the error, at most half its square, is below 1e-14
LARGEST_EXPONENT = 600.0  # of exp, that is finite
SERIES = 1e-3  # below it four terms of exp are exact to 5e-14
THIRD = 1.0 / 3.0
SMALL_GROWTH = 0.01  # of plastic strain in a step, see ``small_power``


def plastic_constants(material: Material) -> NDArray[np.float64]:
    """Return what ``plastic_increment`` needs of a material.

    Returns:
        ``(6,)``: 3 G [Pa], A and B times the softening by temperature [Pa], n, C, reference rate [1/s]. A is infinite
        where a material never yields.
    """
    if not isinstance(material, Isotropic) or material.plasticity is None:
        return NEVER_YIELDS.copy()
    law, softening = material.plasticity, material.softening
    shear = 3.0 * material.shear_modulus
    return np.array([shear, law.A * softening, law.B * softening, law.n, law.C, law.reference_rate])


@njit(cache=True)
def yield_stress(plastic_strain, rate, constants):
    """Return the yield stress [Pa] at an equivalent plastic strain and its rate [1/s]."""
    factor = 1.0
    if constants[4] > 0.0 and rate > constants[5]:
        factor += constants[4] * math.log(rate / constants[5])
    return (constants[1] + constants[2] * plastic_strain ** constants[3]) * factor


@njit(cache=True)
def plastic_increment(trial_mises, plastic_strain, constants, step):
    """Return the increment x of the equivalent plastic strain over a step, at least 0: the implicit radial return.

    It solves q - 3 G x = (A + B (p + x)^n) (1 + C ln max(1, x / (dt rate_0))). In y = ln x the left minus the right
    side is decreasing and concave for n in (0, 1]: Newton's method from the right of the root neither overshoots nor
    needs a bracket, from the left its first step leads to the right. No step goes beyond the increment at the static
    yield stress, which is too large. So it converges whatever the rate, the exponent and the temperature.

    Args:
        trial_mises: Mises stress q of the elastic trial state [Pa].
        plastic_strain: Equivalent plastic strain p before the step.
        constants: Row of ``plastic_constants``.
        step: dt [s].
    """
    stiffness, first, hardening, exponent = constants[0], constants[1], constants[2], constants[3]
    before = hardening * plastic_strain**exponent
    static = first + before
    if not trial_mises > static:  # an elastic step; no increment either from a trial that is not a number
        return 0.0
    sensitivity, slow = constants[4], step * constants[5]
    inverse = 1.0 / plastic_strain if plastic_strain > 0.0 else 0.0
    x = largest = (trial_mises - static) / stiffness
    if sensitivity > 0.0 and x > slow:  # start below both: the increments that only stiffness or only the rate limits
        relaxed = slow * math.exp(min((trial_mises / static - 1.0) / sensitivity, LARGEST_EXPONENT))
        x = max(slow, x * (relaxed / (x + relaxed)))
    is_fast = sensitivity > 0.0 and x >= slow
    excess = math.log(x / slow) if is_fast else 0.0
    for _ in range(ITERATIONS):
        strain = plastic_strain + x
        if x < SMALL_GROWTH * plastic_strain:
            hardened = before * small_power(x * inverse, exponent)
        else:
            hardened = hardening * strain**exponent
        factor, slope = 1.0, 0.0
        if is_fast:
            factor += sensitivity * excess
            slope = (first + hardened) * sensitivity * strain
        slope += x * (stiffness * strain + factor * exponent * hardened)
        change = (stiffness * x + (first + hardened) * factor - trial_mises) * strain / slope
        if abs(change) < SERIES:
            x *= 1.0 - change * (1.0 - change * (0.5 - change / 6.0))
        else:
            x = min(largest, x * math.exp(min(-change, LARGEST_EXPONENT)))
        was_fast, is_fast = is_fast, sensitivity > 0.0 and x >= slow
        if x == 0.0 or (abs(change) < CONVERGED and is_fast == was_fast):
            break
        if is_fast:  # ln x moves by the change itself, unless it was cut
            excess = excess - change if was_fast and x < largest else math.log(x / slow)
    return min(x, largest)


@njit(cache=True, fastmath=FINITE, error_model="numpy")
def small_power(growth, exponent):
    """Return (1 + growth)^exponent of a growth below ``SMALL_GROWTH``: five terms of its series, to 1e-13."""
    n, e = exponent, growth
    higher = 1.0 + e * (n - 2.0) * THIRD * (1.0 + 0.25 * e * (n - 3.0) * (1.0 + 0.2 * e * (n - 4.0)))
    return 1.0 + e * n * (1.0 + 0.5 * e * (n - 1.0) * higher)
