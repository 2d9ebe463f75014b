"""Fits: errors follow a power of the parameter's value, costs a constant and a power."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

STEEPEST_COST = 9.0


@dataclass(frozen=True, slots=True)
class ErrorFit:
    """Error = constant * value ** order.

    Attributes:
        constant: error at value 1.
        order: observed.
        scatter: largest factor by which a measured error is above the fit.
        theory: the order by theory; None without one.
    """

    constant: float
    order: float
    scatter: float
    theory: float | None = None

    def at(self, value: float) -> float:
        """Return the error that is expected."""
        return self.constant * value**self.order

    def value_for(self, error: float) -> float:
        """Return the largest value whose error, with the scatter, is no more than a given one."""
        return (error / (self.constant * self.scatter)) ** (1.0 / self.order)


@dataclass(frozen=True, slots=True)
class CostFit:
    """Cost = start + constant * value ** -exponent, in core-seconds.

    Attributes:
        start: what any run costs: libraries and compiled kernels are loaded.
        constant: what is added at value 1.
        exponent: of one over the value.
        scatter: largest relative difference of a measured cost.
    """

    start: float
    constant: float
    exponent: float
    scatter: float

    def at(self, value: float) -> float:
        """Return the cost that is expected."""
        return self.start + self.constant * value**-self.exponent


def fit_error(values: Sequence[float], errors: Sequence[float], theory: float | None = None) -> ErrorFit | None:
    """Fit a power to errors, by least squares of logarithms; None unless three are known and they grow with the value.

    Args:
        values: of the parameter, positive.
        errors: positive.
        theory: the order by theory.
    """
    if len(values) < 3 or min(errors) <= 0.0:
        return None
    order, logarithm = np.polyfit(np.log(values), np.log(errors), 1)
    if order <= 0.0:
        return None
    expected = np.exp(logarithm) * np.power(values, order)
    return ErrorFit(float(np.exp(logarithm)), float(order), float(np.max(np.divide(errors, expected))), theory)


def fit_cost(values: Sequence[float], costs: Sequence[float]) -> CostFit | None:
    """Fit a constant and a power to costs, by least squares of relative differences; None unless four are known.

    Through three, its three numbers would fit whatever they are, without a scatter.
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
