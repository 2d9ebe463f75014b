"""Coefficients of stabilised leapfrog substeps, from shifted Chebyshev polynomials.

With z = DT^2 M^-1 K, p small steps from rest at q_0 lead to q_p = T_p(delta - z / omega) / T_p(delta) q_0,
delta = 1 + nu / p^2, omega = 2 T_p'(delta) / T_p(delta) (Carle, Hochbruck & Sturm, SIAM J. Numer. Anal. 58, 2020;
nu = 0 is the leapfrog of Diaz & Grote, SIAM J. Sci. Comput. 31, 2009). Leapfrog with 2 (q_0 - q_p) for z q_0 is stable
up to z = omega (1 + delta), and |q_p| <= 1 / T_p(delta) from z = omega (delta - 1) on.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import LevelError

LARGEST_DAMPING, ROUNDING = 0.03, 1e-9
FIRST, GROWTH = 0.15, 2.5  # nu of the outermost level, and its growth from level to level inwards


@dataclass(frozen=True, slots=True)
class Substeps:
    """Coefficients of the p substeps of one level inside a step DT of the surrounding level.

    Substep k changes the displacement by d_k = memory_k d_{k-1} + rate_k DT^2 f(q_k) / m. The mean force of the step,
    by which q_p = q_0 + DT^2 f / (2 m), is the sum of weight_k f(q_k): weights are positive and add up to one.

    Attributes:
        memory: Factor on the previous displacement change, shape (p,); the first is zero.
        rate: Factor on DT^2 times the acceleration, shape (p,).
        weight: Weight of each substep in the mean force, shape (p,).
        reach: Largest stable step relative to p plain leapfrog steps.
    """

    memory: NDArray[np.float64]
    rate: NDArray[np.float64]
    weight: NDArray[np.float64]
    reach: float

    @classmethod
    def of(cls, count: int, level: int, damping: float = 0.0) -> "Substeps":
        """Return the coefficients of the substeps of a level.

        Args:
            count: Substeps in one step of the surrounding level.
            level: Number of the level, 1 for the outermost.
            damping: Coefficient beta of stiffness-proportional damping over the step of the model, dimensionless.

        Raises:
            LevelError: The damping is too strong.
        """
        delta = 1.0 + stabilisation(level, damping) / count**2
        value, slope = _chebyshev(count, delta)
        omega = 2.0 * slope[count] / value[count]
        rate = np.concatenate([[1.0 / delta], 2.0 * value[1:count] / value[2:]]) / omega
        memory = np.concatenate([[0.0], value[: count - 1] / value[2:]])
        weight = np.empty(count)
        following = 0.0
        for k in range(count - 1, -1, -1):  # contribution of d_k to q_p, with its memory in all later substeps
            following = 1.0 + (memory[k + 1] * following if k + 1 < count else 0.0)
            weight[k] = 2.0 * rate[k] * following
        return cls(memory, rate, weight, float(np.sqrt(omega * (1.0 + delta))) / (2.0 * count))


def stabilisation(level: int, damping: float = 0.0) -> float:
    """Return the stabilisation parameter nu of a level.

    A step of an inner level is itself a leapfrog whose highest frequencies reach about z = 4 / (1 + nu) for any
    elements: nu must grow inwards so that this stays below the stability limit of the surrounding level. ``FIRST``
    and ``GROWTH`` were determined on chains of random elements, levels and impedances
    (tests/stability/test_fem_levels.py). Damping by beta K_eff, half a step late, is stable up to
    z (1 + 2 beta / DT) = 4: the largest z = 2 + 2 / cosh(sqrt(2 nu)) of many substeps is reduced by the same factor.

    Args:
        level: Number of the level, 1 for the outermost.
        damping: Coefficient beta over the step DT of the model, at most ``LARGEST_DAMPING``.

    Returns:
        Dimensionless nu of the Chebyshev polynomials of this level, see ``Substeps``.

    Raises:
        LevelError: The damping is too strong.
    """
    if damping > LARGEST_DAMPING * (1.0 + ROUNDING):
        raise LevelError(
            f"damping.stiffness_coefficient = {damping:.3g} windows is too large for local time steps; the limit is"
            f" {LARGEST_DAMPING:g} windows, {LARGEST_DAMPING / damping:.3g} of it; or use scheme = held_velocity"
        )
    largest = (2.0 + 2.0 / np.cosh(np.sqrt(2.0 * FIRST))) / (1.0 + 2.0 * damping)
    return float(0.5 * np.arccosh(2.0 / (largest - 2.0)) ** 2) * GROWTH ** (level - 1)


def _chebyshev(degree: int, x: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the Chebyshev polynomials T_k(x) and T_k'(x) for k = 0 ... degree, each of shape (degree + 1,)."""
    value, slope = np.ones(degree + 1), np.zeros(degree + 1)
    value[1], slope[1] = x, 1.0
    for k in range(1, degree):
        value[k + 1] = 2.0 * x * value[k] - value[k - 1]
        slope[k + 1] = 2.0 * value[k] + 2.0 * x * slope[k] - slope[k - 1]
    return value, slope
