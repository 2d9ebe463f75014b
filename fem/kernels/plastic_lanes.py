"""Numba kernels of the radial return at one point of sixteen elements, without branches.

The same equation and the same Newton steps in ln x as ``plasticity.plastic_increment``, all lanes together until the
last one has converged. Logarithm and exponential are polynomials, because calls of library functions keep the compiler
from vector instructions; they are exact to a few units in the last place, the exponential of its argument.
"""

import math
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from reflowshock.fem.kernels.lanes import LANE_OPTIONS, LANES, put_six_of, six, six_of
from reflowshock.fem.kernels.nonlinear import INCREMENT, MISES, NOMINAL, PLASTIC
from reflowshock.fem.kernels.plasticity import small_power
from reflowshock.materials.plasticity import CONVERGED, FIRST_YIELD, ITERATIONS, LARGEST_EXPONENT, SMALL_GROWTH

TINY = 1e-300  # in the place of zero under a logarithm
ABOVE = 1e-3  # of a ceiling over its rough logarithm: it only keeps steps from going far beyond
LN2 = 0.6931471805599453
ROOT_BITS = 0x3FE6A09E667F3BCD  # of sqrt(1/2): mantissas are taken from there to sqrt(2)
MANTISSA, BIAS = 52, 1023
# Slots of the workspace where ``kernels.nonlinear`` has the nominal stress, which is written afterwards.
FLOW, LOGARITHM, CEILING, BEFORE, INVERSE = (NOMINAL + LANES * k for k in range(5))


def bit_pattern(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Generate the LLVM instruction that reinterprets the bits of a value; Numba calls it to compile ``bits_of``.

    Args:
        context: Numba's target context, which translates types.
        builder: LLVM IR builder of the function that is compiled.
        signature: Numba signature; its return type is the type of the result.
        arguments: LLVM values of the arguments, of which there is one.

    Returns:
        LLVM value of the result.
    """
    return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))


@intrinsic
def bits_of(context: Any, value: Any) -> Any:
    """Return the 64 bits of a float as an int64; a Numba intrinsic, called in kernels as ``bits_of(value)``."""
    return types.int64(types.float64), bit_pattern


@intrinsic
def float_of(context: Any, bits: Any) -> Any:
    """Return the float64 with the 64 bits of an int64; a Numba intrinsic, called in kernels as ``float_of(bits)``."""
    return types.float64(types.int64), bit_pattern


@njit(**LANE_OPTIONS)
def log(x):
    """Return ln x of a positive normal scalar: x = 2^k m, ln m = 2 artanh((m - 1) / (m + 1)) by its series."""
    shifted = bits_of(x) - np.int64(ROOT_BITS)
    k = shifted >> np.int64(MANTISSA)
    m = float_of(bits_of(x) - (k << np.int64(MANTISSA)))
    s = (m - 1.0) / (m + 1.0)
    z = s * s
    series = 1.0 / 21.0
    series = 1.0 / 19.0 + z * series
    series = 1.0 / 17.0 + z * series
    series = 1.0 / 15.0 + z * series
    series = 1.0 / 13.0 + z * series
    series = 1.0 / 11.0 + z * series
    series = 1.0 / 9.0 + z * series
    series = 1.0 / 7.0 + z * series
    series = 1.0 / 5.0 + z * series
    series = 1.0 / 3.0 + z * series
    return k * LN2 + 2.0 * s * (1.0 + z * series)


@njit(**LANE_OPTIONS)
def exp(x):
    """Return e^x of a scalar, clipped to +-``LARGEST_EXPONENT``: x = k ln 2 + r, series of e^r to r^12."""
    x = min(max(x, -LARGEST_EXPONENT), LARGEST_EXPONENT)
    k = math.floor(x / LN2 + 0.5)
    r = x - k * LN2
    series = 1.0 / 12.0
    series = (1.0 + r * series) / 11.0
    series = (1.0 + r * series) / 10.0
    series = (1.0 + r * series) / 9.0
    series = (1.0 + r * series) / 8.0
    series = (1.0 + r * series) / 7.0
    series = (1.0 + r * series) / 6.0
    series = (1.0 + r * series) / 5.0
    series = (1.0 + r * series) / 4.0
    series = (1.0 + r * series) / 3.0
    series = (1.0 + r * series) / 2.0
    power = float_of((np.int64(k) + np.int64(BIAS)) << np.int64(MANTISSA))
    return power + power * (r + r * r * series)


@njit(**LANE_OPTIONS)
def rough_log(x):
    """Return ln x of a positive scalar with an absolute error of at most 4e-5."""
    k = (bits_of(x) - np.int64(ROOT_BITS)) >> np.int64(MANTISSA)
    m = float_of(bits_of(x) - (k << np.int64(MANTISSA)))
    s = (m - 1.0) / (m + 1.0)
    return k * LN2 + s * (2.0 + s * s * (2.0 / 3.0))


@njit(**LANE_OPTIONS)
def rough_exp(x):
    """Return e^x of a scalar with a relative error of at most 1e-3; x is clipped to +-``LARGEST_EXPONENT``."""
    x = min(max(x, -LARGEST_EXPONENT), LARGEST_EXPONENT)
    k = math.floor(x / LN2 + 0.5)
    r = x - k * LN2
    power = float_of((np.int64(k) + np.int64(BIAS)) << np.int64(MANTISSA))
    return power * (1.0 + r * (1.0 + r * (0.5 + r / 6.0)))


@njit(**LANE_OPTIONS)
def start_flow(w, state, g, law, reference):
    """Write start values of Newton's method for the plastic strain increments x of sixteen elements at one point.

    Without hardening within the step 3 G x + Y C y = q - Y, y = ln(x / reference). With y_r = (q - Y) / (C Y), where
    only the rate limits x, and y_c, where only the stiffness does, y = y_r - W(y_r exp(y_r - y_c)); W is Lambert's
    function to 1 % (Iacono & Boyd, Adv. Comput. Math. 43, 2017).

    Args:
        w: Flat workspace of ``kernels.nonlinear``. Reads the trial von Mises stress q [Pa] at ``MISES``; writes x at
            ``FLOW``, y at ``LOGARITHM``, its upper bound at ``CEILING``, the hardening before the step [Pa] at
            ``BEFORE`` and the reciprocal of the plastic strain at ``INVERSE``; sixteen entries each.
        state: State of all points, shape (points, >= 112); reads the plastic strain at ``PLASTIC``.
        g: Number of the point, row of ``state``, integer.
        law: 3 G [Pa], first yield stress [Pa], hardening modulus [Pa], exponent and rate sensitivity C, which is 0
            where the rate does not count; scalars.
        reference: Increment of the plastic strain at the reference rate, positive scalar; 1 if the rate does not count.

    Returns:
        Number of the sixteen elements that yield, as a float.
    """
    stiffness, first, hardening, exponent, sensitivity = law
    divisor, inverse = sensitivity if sensitivity > 0.0 else 1.0, 1.0 / (stiffness * reference)
    count = 0.0
    for lane in range(LANES):
        strain = max(state[g, PLASTIC + lane], TINY)
        before = hardening * exp(exponent * log(strain))
        above = w[MISES + lane] - first - before
        count += 1.0 if above > 0.0 else 0.0
        ceiling = rough_log(max(above, TINY) * inverse)
        relaxed = above / ((first + before) * divisor)
        grown = rough_log(1.0 + max(relaxed, 0.0) * rough_exp(relaxed - ceiling))
        lambert = grown * (1.0 - rough_log(1.0 + grown) / (2.0 + grown))
        y = min(ceiling, max(relaxed - lambert, 0.0)) if sensitivity > 0.0 else ceiling
        w[LOGARITHM + lane], w[CEILING + lane] = y, ceiling + ABOVE
        w[FLOW + lane] = reference * exp(y) if above > 0.0 else 0.0
        w[BEFORE + lane], w[INVERSE + lane] = before, 1.0 / strain
    return count


@njit(**LANE_OPTIONS)
def growing(w):
    """Return the number of the sixteen elements, as a float, whose plastic strain grows too much for ``small_power``.

    Args:
        w: Flat workspace; reads plastic strain increments at ``FLOW`` and reciprocals of the plastic strain before the
            step at ``INVERSE``, sixteen entries each.
    """
    count = 0.0
    for lane in range(LANES):
        count += 1.0 if w[FLOW + lane] * w[INVERSE + lane] > SMALL_GROWTH else 0.0
    return count


@njit(**LANE_OPTIONS)
def improve_flow(w, state, g, law, reference):
    """Take a Newton step in y = ln(x / reference) for the plastic strain increments x of sixteen elements at one point.

    Args:
        w: Flat workspace that ``start_flow`` has filled; x at ``FLOW`` and y at ``LOGARITHM`` are improved, sixteen
            entries each.
        state: State of all points, shape (points, >= 112); reads the plastic strain at ``PLASTIC``.
        g: Number of the point, row of ``state``, integer.
        law: 3 G [Pa], first yield stress [Pa], hardening modulus [Pa], exponent and rate sensitivity; scalars.
        reference: Increment of the plastic strain at the reference rate, positive scalar; 1 if the rate does not count.

    Returns:
        Number of elements that have not converged, as a float.
    """
    stiffness, first, hardening, exponent, sensitivity = law
    count, is_small = 0.0, growing(w) == 0.0
    for lane in range(LANES):
        x, y = w[FLOW + lane], w[LOGARITHM + lane]
        total = state[g, PLASTIC + lane] + x
        if is_small:
            hardened = w[BEFORE + lane] * small_power(x * w[INVERSE + lane], exponent)
        else:
            hardened = hardening * exp(exponent * log(max(total, TINY)))
        rate = sensitivity * max(y, 0.0)
        slope = (first + hardened) * sensitivity * total if y >= 0.0 else 0.0
        slope += x * (stiffness * total + (1.0 + rate) * exponent * hardened)
        excess = stiffness * x + (first + hardened) * (1.0 + rate) - w[MISES + lane]
        change = excess * total / slope if x > 0.0 else 0.0
        new = min(y - change, w[CEILING + lane])
        count += 1.0 if (abs(change) > CONVERGED) | ((y >= 0.0) != (new >= 0.0)) else 0.0
        w[LOGARITHM + lane] = new
        w[FLOW + lane] = reference * exp(new) if x > 0.0 else 0.0
    return count


@njit(**LANE_OPTIONS)
def finish_flow(w, state, g, stiffness):
    """Return the stresses of sixteen elements at one point to the yield surface by the converged increments.

    Args:
        w: Flat workspace: the plastic strain increments at ``FLOW`` become plastic work densities [J/m^3], the trial
            von Mises stresses at ``MISES`` the ones after the step [Pa]; reads six strain increments at ``INCREMENT``.
        state: State of all points, entry k of element e in column ``16 * k + e``, shape (points, >= 112); the six
            stresses [Pa] and the plastic strain of the point are updated.
        g: Number of the point, row of ``state``, integer.
        stiffness: 3 G with the shear modulus G, scalar [Pa].
    """
    for lane in range(LANES):
        s, d, flow, trial = six_of(state, g, lane), six(w, INCREMENT + lane), w[FLOW + lane], w[MISES + lane]
        p = (s[0] + s[1] + s[2]) / 3.0
        raised = (s[0] - p) * d[0] + (s[1] - p) * d[1] + (s[2] - p) * d[2] + s[3] * d[3] + s[4] * d[4] + s[5] * d[5]
        mean = trial - 0.5 * stiffness * (flow + raised / max(trial, TINY))
        mises = trial - stiffness * flow
        factor = mises / max(trial, TINY) if flow > 0.0 else 1.0
        back = (1.0 - factor) * p
        put_six_of(
            state,
            g,
            lane,
            (
                back + factor * s[0],
                back + factor * s[1],
                back + factor * s[2],
                factor * s[3],
                factor * s[4],
                factor * s[5],
            ),
        )
        state[g, PLASTIC + lane] += flow
        w[FLOW + lane] = flow * mean
        w[MISES + lane] = mises


@njit(**LANE_OPTIONS)
def law_of(plastic, material, step):
    """Return the constants of the plastic law of a material, and the time step, as seven scalars.

    Args:
        plastic: Plastic constants of the materials, shape (nm, 6), see ``materials.plasticity.plastic_constants``.
        material: Index of the material, integer.
        step: Time step dt, scalar [s].

    Returns:
        3 G [Pa], first yield stress [Pa], hardening modulus [Pa], exponent, rate sensitivity, reference rate [1/s], dt
        [s].
    """
    k = plastic[material]
    return k[0], k[1], k[2], k[3], k[4], k[5], step


@njit(cache=True, error_model="numpy")
def plastic_flow(w, state, g, law):
    """Return the stress of sixteen elements at one point to the yield surface where the trial state lies outside.

    Args:
        w: Flat workspace, shape (544,), with six strain increments at ``INCREMENT`` and the trial von Mises stress at
            ``MISES`` [Pa], which becomes the one after the step; plastic work densities [J/m^3] are written at
            ``FLOW``.
        state: State of all points, entry k of element e in column ``16 * k + e``, shape (points, >= 112): six elastic
            trial stresses [Pa] and the plastic strain; both are updated at the point (radial return).
        g: Number of the point, row of ``state``, integer.
        law: Seven scalars: 3 G [Pa], first yield stress [Pa], hardening modulus [Pa], exponent, rate sensitivity,
            reference rate [1/s], time step [s].

    Returns:
        Whether any of the elements yields; then ``add_work`` can follow.
    """
    if count_above(w, MISES, law[FIRST_YIELD]) == 0.0:
        return False
    reference, sensitivity = law[6] * law[5], law[4]
    if not 0.0 < reference < np.inf:
        reference, sensitivity = 1.0, 0.0
    own = (law[0], law[1], law[2], law[3], sensitivity)
    if start_flow(w, state, g, own, reference) == 0.0:
        return False
    for _ in range(ITERATIONS):
        if improve_flow(w, state, g, own, reference) == 0.0:
            break
    finish_flow(w, state, g, law[0])
    return True


@njit(**LANE_OPTIONS)
def add_work(w, weight, g, work):
    """Add the plastic work of sixteen elements at a point that yields.

    It is the mean of the stress before and after the step times the plastic strain increment, as the elastic energy s :
    C^-1 : s / 2 is integrated by the mean stress exactly: the sum of both is the work of the internal force.

    Args:
        w: Flat workspace; reads the sixteen plastic work densities at ``FLOW`` [J/m^3], which ``plastic_flow`` writes.
        weight: Volumes of the points, shape (points, 16) [m^3].
        g: Number of the point, row of ``weight``, integer.
        work: Plastic work of each element, shape (16,) [J], added to.
    """
    for lane in range(LANES):
        work[lane] += weight[g, lane] * w[FLOW + lane]


@njit(**LANE_OPTIONS)
def count_above(values, at, limit):
    """Return how many of the sixteen scalars ``values[at]`` to ``values[at + 15]`` are above a limit, as a float.

    Args:
        values: Flat array, shape (>= at + 16,).
        at: Position of the first scalar, integer.
        limit: Limit, a scalar in the unit of the values.
    """
    count = 0.0
    for lane in range(LANES):
        count += 1.0 if values[at + lane] > limit else 0.0
    return count
