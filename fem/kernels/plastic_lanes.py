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
    """Return the value of other type with the same bits."""
    return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))


@intrinsic
def bits_of(context: Any, value: Any) -> Any:
    """Return the bits of a float as an integer."""
    return types.int64(types.float64), bit_pattern


@intrinsic
def float_of(context: Any, bits: Any) -> Any:
    """Return the float of the bits of an integer."""
    return types.float64(types.int64), bit_pattern


@njit(**LANE_OPTIONS)
def log(x):
    """Return ln x of a positive normal number: x = 2^k m, ln m = 2 artanh((m - 1) / (m + 1)) by its series."""
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
    """Return e^x between -``LARGEST_EXPONENT`` and it: x = k ln 2 + r, the series of e^r to r^12."""
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
    """Return ln x to 4e-5."""
    k = (bits_of(x) - np.int64(ROOT_BITS)) >> np.int64(MANTISSA)
    m = float_of(bits_of(x) - (k << np.int64(MANTISSA)))
    s = (m - 1.0) / (m + 1.0)
    return k * LN2 + s * (2.0 + s * s * (2.0 / 3.0))


@njit(**LANE_OPTIONS)
def rough_exp(x):
    """Return e^x to a share of 1e-3."""
    x = min(max(x, -LARGEST_EXPONENT), LARGEST_EXPONENT)
    k = math.floor(x / LN2 + 0.5)
    r = x - k * LN2
    power = float_of((np.int64(k) + np.int64(BIAS)) << np.int64(MANTISSA))
    return power * (1.0 + r * (1.0 + r * (0.5 + r / 6.0)))


@njit(**LANE_OPTIONS)
def start_flow(w, state, g, law, reference):
    """Write y = ln(x / reference) of increments x to start from, and of those at the static yield stress.

    Without hardening within the step 3 G x + Y C y = q - Y. With y_r = (q - Y) / (C Y), where only the rate limits x,
    and y_c, where only the stiffness does, y = y_r - W(y_r exp(y_r - y_c)); W is Lambert's function to 1 %
    (Iacono & Boyd, Adv. Comput. Math. 43, 2017).

    Args:
        w: Workspace, with ``MISES``.
        state: ``(m, .)`` of the points.
        g: Which point.
        law: Row of ``plastic_constants``, with sensitivity 0 where the rate does not count.
        reference: Increment of the plastic strain at the reference rate, or any.

    Returns:
        In how many lanes something flows.
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
    """Return in how many lanes the plastic strain grows by too much for ``small_power``."""
    count = 0.0
    for lane in range(LANES):
        count += 1.0 if w[FLOW + lane] * w[INVERSE + lane] > SMALL_GROWTH else 0.0
    return count


@njit(**LANE_OPTIONS)
def improve_flow(w, state, g, law, reference):
    """Take a Newton step in y; return in how many lanes it has not converged. Arguments as above."""
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
    """Return the stress to the yield surface by the increments found; write plastic work densities there."""
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
    """Return the row of ``materials.plasticity.plastic_constants`` of a material, and the step dt [s]."""
    k = plastic[material]
    return k[0], k[1], k[2], k[3], k[4], k[5], step


@njit(cache=True, error_model="numpy")
def plastic_flow(w, state, g, law):
    """Return the stress to the yield surface where the elastic trial state lies outside (radial return).

    Its von Mises stress is then that after the step.

    Args:
        w: Workspace of ``kernels.nonlinear``.
        state: ``(m, .)`` of the points, with the elastic trial stress.
        g: Which point.
        law: See ``law_of``; its first entry is 3 G.

    Returns:
        Whether any lane flows; then ``add_work`` can follow.
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
    """Add the plastic work of a point that flows.

    It is the mean of the stress before and after the step times the plastic strain increment, as the elastic energy
    s : C^-1 : s / 2 is integrated by the mean stress exactly: the sum of both is the work of the internal force.

    Args:
        w: Workspace after ``plastic_flow``.
        weight: ``(m, 16)`` [m^3] volumes of the points.
        g: Which point.
        work: ``(16,)`` [J].
    """
    for lane in range(LANES):
        work[lane] += weight[g, lane] * w[FLOW + lane]


@njit(**LANE_OPTIONS)
def count_above(values, at, limit):
    """Return in how many lanes an entry is above a limit."""
    count = 0.0
    for lane in range(LANES):
        count += 1.0 if values[at + lane] > limit else 0.0
    return count
