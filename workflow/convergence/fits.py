"""Fits of errors and costs over the value h of a parameter: error = C h^p, cost = t0 + D h^-q."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

STEEPEST_COST = 9.0


@dataclass(frozen=True, slots=True)
class ErrorFit:
    """Fit of the error, constant * value ** order.

    Attributes:
        constant: Error at value 1.
        order: Observed order.
        scatter: Largest factor by which a measured error exceeds the fit.
        theory: Theoretical order; None without theory.
    """

    constant: float
    order: float
    scatter: float
    theory: float | None = None

    def at(self, value: float) -> float:
        """Return the expected error at a value."""
        return self.constant * value**self.order

    def value_for(self, error: float) -> float:
        """Return the largest value whose error, including the scatter, does not exceed ``error``."""
        return (error / (self.constant * self.scatter)) ** (1.0 / self.order)


@dataclass(frozen=True, slots=True)
class CostFit:
    """Fit of the cost in core-seconds, start + constant * value ** -exponent.

    Attributes:
        start: Cost of any run: loading of libraries and compiled kernels [s].
        constant: Additional cost at value 1 [s].
        exponent: Exponent of 1 / value.
        scatter: Largest relative difference between a measured cost and the fit.
    """

    start: float
    constant: float
    exponent: float
    scatter: float

    def at(self, value: float) -> float:
        """Return the expected cost at a value [core-seconds]."""
        return self.start + self.constant * value**-self.exponent


def fit_error(values: Sequence[float], errors: Sequence[float], theory: float | None = None) -> ErrorFit | None:
    """Fit a power to errors by least squares of logarithms.

    Args:
        values: Values of the parameter, positive.
        errors: Errors at these values, positive.
        theory: Theoretical order; None without theory.

    Returns:
        The fit; None for fewer than three values, or if errors do not grow with the value.
    """
    if len(values) < 3 or min(errors) <= 0.0:
        return None
    order, logarithm = np.polyfit(np.log(values), np.log(errors), 1)
    if order <= 0.0:
        return None
    expected = np.exp(logarithm) * np.power(values, order)
    return ErrorFit(float(np.exp(logarithm)), float(order), float(np.max(np.divide(errors, expected))), theory)


def fit_cost(values: Sequence[float], costs: Sequence[float]) -> CostFit | None:
    """Fit a constant and a power to costs by least squares of relative differences.

    Args:
        values: Values of the parameter, positive.
        costs: Costs at these values, positive [core-seconds].

    Returns:
        The fit; None for fewer than four values, which three coefficients would fit without any scatter.
    """
    if len(values) < 4 or min(costs) <= 0.0:
        return None
    from scipy.optimize import minimize_scalar, nnls

    measured = np.asarray(costs, dtype=float)

    def solve(exponent: float) -> tuple[np.ndarray, float]:
        columns = np.column_stack((np.ones(len(measured)), np.power(values, -exponent)))
        return nnls(columns / measured[:, None], np.ones(len(measured)))

    exponent = float(minimize_scalar(lambda q: solve(q)[1], bounds=(0.1, STEEPEST_COST), method="bounded").x)
    start, constant = solve(exponent)[0]
    expected = start + constant * np.power(values, -exponent)
    return CostFit(float(start), float(constant), exponent, float(np.max(np.abs(expected / measured - 1.0))))
