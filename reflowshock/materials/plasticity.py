"""J2 plasticity of Johnson and Cook at one point: yield stress and implicit radial return.

The rate factor is the classical 1 + C ln max(1, r), with the ratio r of the rate to the reference rate, and not the
smooth 1 + C ln(1 + r): published constants are fitted to the former, and the latter raises the yield stress at the
reference rate, where A and B are measured, by C ln 2.

Plain functions of scalars: Python calls them as they are, ``fem.kernels.plasticity`` compiles them.
"""

import math

import numpy as np
from numpy.typing import NDArray

from reflowshock.materials.parameters import Material

NEVER_YIELDS = np.array([1.0, np.inf, 0.0, 1.0, 0.0, 1.0])  # ``plastic_constants`` of an elastic material
FIRST_YIELD = 1  # column of the initial yield stress, infinite for an elastic material
ITERATIONS = 100  # far more than any admissible constants need; typical are 2
CONVERGED = 1e-7  # relative correction; the remaining error, at most half its square, is below 1e-14
LARGEST_EXPONENT = 600.0  # exp of it is finite
SERIES = 1e-3  # exponent below which four terms of exp are exact to 5e-14
THIRD = 1.0 / 3.0
SMALL_GROWTH = 0.01  # relative growth of the plastic strain in a step up to which ``small_power`` is exact


def plastic_constants(material: Material) -> NDArray[np.float64]:
    """Return the constants of a material for ``yield_stress`` and ``plastic_increment``.

    Args:
        material: Material with or without plasticity, and the temperature that softens it.

    Returns:
        Array of shape (6,): 3 G [Pa], A and B times the thermal softening [Pa], n, C, reference rate [1/s]. A is
        infinite for an elastic material.
    """
    constants = material.yield_constants
    return NEVER_YIELDS.copy() if constants is None else np.array(constants)


def yield_stress(plastic_strain, rate, constants):
    """Return the yield stress [Pa] of Johnson and Cook at a point; a compiled function of scalars.

    Args:
        plastic_strain: Equivalent plastic strain, a scalar.
        rate: Rate of the equivalent plastic strain, a scalar [1/s].
        constants: Array of ``plastic_constants``, shape (6,): 3 G [Pa], A and B [Pa], n, C, reference rate [1/s].
    """
    factor = 1.0
    if constants[4] > 0.0 and rate > constants[5]:
        factor += constants[4] * math.log(rate / constants[5])
    return (constants[1] + constants[2] * plastic_strain ** constants[3]) * factor


def plastic_increment(trial_mises, plastic_strain, constants, step):
    """Return the increment of the equivalent plastic strain over a time step, a scalar that is at least 0.

    It is the implicit radial return at one point, a compiled function. Newton's method solves q - 3 G x = (A + B (p +
    x)^n) (1 + C ln max(1, x / (dt rate_0))) for the increment x. In y = ln x the residual is decreasing and concave for
    n in (0, 1]: from the right of the root the iteration does not overshoot, and from the left its first step leads to
    the right of it. Each step is limited by the increment at the static yield stress, an upper bound. The iteration
    therefore converges for every rate, exponent and temperature.

    Args:
        trial_mises: Mises stress q of the elastic trial state, a scalar [Pa].
        plastic_strain: Equivalent plastic strain p before the step, a scalar.
        constants: Array of ``plastic_constants``, shape (6,): 3 G [Pa], A and B [Pa], n, C, reference rate [1/s].
        step: Time step dt, a scalar [s].
    """
    stiffness, first, hardening, exponent = constants[0], constants[1], constants[2], constants[3]
    before = hardening * plastic_strain**exponent
    static = first + before
    if not trial_mises > static:  # elastic step, or a trial stress that is not a number
        return 0.0
    sensitivity, slow = constants[4], step * constants[5]
    inverse = 1.0 / plastic_strain if plastic_strain > 0.0 else 0.0
    x = largest = (trial_mises - static) / stiffness
    if sensitivity > 0.0 and x > slow:  # start below the increments limited by stiffness alone and by rate alone
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
        if is_fast:  # ln x changes by the correction itself, unless it was limited
            excess = excess - change if was_fast and x < largest else math.log(x / slow)
    return min(x, largest)


def small_power(growth, exponent):
    """Return (1 + growth)^exponent, a scalar, for a small growth.

    Five terms of the series are exact to 1e-13.

    Args:
        growth: Scalar of a magnitude below ``SMALL_GROWTH``.
        exponent: Scalar.
    """
    n, e = exponent, growth
    higher = 1.0 + e * (n - 2.0) * THIRD * (1.0 + 0.25 * e * (n - 3.0) * (1.0 + 0.2 * e * (n - 4.0)))
    return 1.0 + e * n * (1.0 + 0.5 * e * (n - 1.0) * higher)
