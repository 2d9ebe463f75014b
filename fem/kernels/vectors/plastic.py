"""Radial return at one point of a vector of elements, without branches.

The same equation and the same Newton steps in ln x as ``plasticity.plastic_increment``, all lanes together until the
last one has converged.
"""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.plasticity import small_power
from reflowshock.fem.kernels.vectors.functions import choose, exp, larger, log, rough_exp, rough_log, smaller
from reflowshock.fem.kernels.vectors.memory import all_below, broadcast
from reflowshock.fem.kernels.vectors.vector import VECTOR_OPTIONS
from reflowshock.materials.plasticity import CONVERGED, ITERATIONS, SMALL_GROWTH

TINY = 1e-300  # in the place of zero under a logarithm
ABOVE = 1e-3  # of a ceiling over its rough logarithm: it only keeps steps from going far beyond


@njit(**VECTOR_OPTIONS)
def law_at(plastic, material, step):
    """Return the constants of the plastic law of a material for steps of a length.

    Args:
        plastic: Pointer to the constants of the materials, six each: 3 G, A, B [Pa], exponent n, rate sensitivity C and
            reference rate [1/s] (Johnson and Cook).
        material: Index of the material, integer.
        step: Time step dt, scalar [s]; infinity means quasi-static.

    Returns:
        3 G [Pa], first yield stress [Pa], hardening modulus [Pa], exponent, rate sensitivity (0 where the rate does not
        count), and the increment of the plastic strain at the reference rate (then 1); six scalars.
    """
    k = 6 * np.int64(material)
    reference, sensitivity = step * plastic[k + 5], plastic[k + 4]
    if not 0.0 < reference < np.inf:
        reference, sensitivity = 1.0, 0.0
    return plastic[k], plastic[k + 1], plastic[k + 2], plastic[k + 3], sensitivity, reference


@njit(**VECTOR_OPTIONS)
def hardened_by(strain, law):
    """Return the hardening B p^n, a SIMD vector of ``WIDTH`` lanes [Pa].

    Args:
        strain: Equivalent plastic strain p, SIMD vector.
        law: Constants of ``law_at``, six scalars; the third is B [Pa], the fourth n.
    """
    return law[2] * exp(law[3] * log(larger(strain, broadcast(TINY))))


@njit(**VECTOR_OPTIONS)
def started(above, before, law):
    """Return y = ln(x / reference) to start Newton's method with, and its upper bound, two SIMD vectors.

    The unknown x is the increment of the plastic strain. Without hardening within the step 3 G x + Y C y = q - Y. With
    y_r = (q - Y) / (C Y), where only the rate limits x, and y_c, where only the stiffness does, y = y_r - W(y_r exp(y_r
    - y_c)); W is Lambert's function to 1 % (Iacono & Boyd, Adv. Comput. Math. 43, 2017).

    Args:
        above: Excess q - Y of the trial von Mises stress q over the static yield stress Y, SIMD vector [Pa].
        before: Hardening before the step, SIMD vector [Pa].
        law: Constants of ``law_at``, six scalars: 3 G, first yield stress, B [Pa], n, C, reference increment.
    """
    none = broadcast(0.0)
    ceiling = rough_log(larger(above, broadcast(TINY)) * (1.0 / (law[0] * law[5])))
    if law[4] == 0.0:
        return ceiling, ceiling + ABOVE
    relaxed = above / ((law[1] + before) * law[4])
    grown = rough_log(1.0 + larger(relaxed, none) * rough_exp(relaxed - ceiling))
    lambert = grown * (1.0 - rough_log(1.0 + grown) / (2.0 + grown))
    return smaller(ceiling, larger(relaxed - lambert, none)), ceiling + ABOVE


@njit(**VECTOR_OPTIONS)
def plastic_strains(trial, strain, law):
    """Return the increments x of the plastic strain by implicit radial return, a SIMD vector; 0 without yielding.

    Args:
        trial: Von Mises stress of the elastic trial state, SIMD vector of ``WIDTH`` lanes [Pa].
        strain: Plastic strain before the step, SIMD vector.
        law: Constants of ``law_at``, six scalars: 3 G, first yield stress, B [Pa], n, C, reference increment.
    """
    none, one = broadcast(0.0), broadcast(1.0)
    before = hardened_by(strain, law)
    above = trial - law[1] - before
    if all_below(above, TINY):
        return none
    y, ceiling = started(above, before, law)
    inverse = one / larger(strain, broadcast(TINY))
    yields = choose(none, above, one, none)
    x = yields * law[5] * exp(y)
    for _ in range(ITERATIONS):
        total = strain + x
        if all_below(x * inverse, SMALL_GROWTH):
            hardened = before * small_power(x * inverse, law[3])
        else:
            hardened = hardened_by(total, law)
        rate = law[4] * larger(y, none)
        slope = choose(y, none, none, (law[1] + hardened) * law[4] * total)
        slope = slope + x * (law[0] * total + (1.0 + rate) * law[3] * hardened)
        excess = law[0] * x + (law[1] + hardened) * (1.0 + rate) - trial
        change = choose(none, x, excess * total / slope, none)
        new = smaller(y - change, ceiling)
        crosses = choose(y, none, one, none) - choose(new, none, one, none)
        y, x = new, choose(none, x, law[5] * exp(new), none)
        if all_below(larger(change, -change) * (1.0 / CONVERGED) + crosses * crosses, 1.0):
            break
    return x


@njit(**VECTOR_OPTIONS)
def returned(s, d, trial, flow, stiffness):
    """Return stresses to the yield surface, and compute the plastic work.

    Args:
        s: Elastic trial stress, six SIMD vectors xx, yy, zz, xy, yz, xz [Pa].
        d: Strain increment in this order with engineering shear, six SIMD vectors.
        trial: Von Mises stress of the trial state, SIMD vector [Pa].
        flow: Increment of the plastic strain, SIMD vector; where it is 0 the stress stays.
        stiffness: 3 G with the shear modulus G, scalar [Pa].

    Returns:
        Stress on the yield surface, six SIMD vectors in this order [Pa], and plastic work density, SIMD vector [J/m^3].
    """
    p, divisor = (s[0] + s[1] + s[2]) * (1.0 / 3.0), larger(trial, broadcast(TINY))
    raised = (s[0] - p) * d[0] + (s[1] - p) * d[1] + (s[2] - p) * d[2] + s[3] * d[3] + s[4] * d[4] + s[5] * d[5]
    density = flow * (trial - 0.5 * stiffness * (flow + raised / divisor))
    none = broadcast(0.0)
    factor = choose(none, flow, (trial - stiffness * flow) / divisor, broadcast(1.0))
    back = choose(none, flow, (1.0 - factor) * p, none)
    return (
        back + factor * s[0],
        back + factor * s[1],
        back + factor * s[2],
        factor * s[3],
        factor * s[4],
        factor * s[5],
    ), density
