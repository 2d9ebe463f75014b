"""Errors of computed quantities against an exact solution, a chosen run, a Richardson extrapolation or the finest run.

Richardson extrapolation and the observed order follow Roache, J. Fluids Eng. 116 (1994) 405.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reflowshock.workflow.convergence.convergence_study import Quantity, StudyRun, Values
from reflowshock.workflow.convergence.grid_convergence import observed_order

LARGEST_ORDER = 2.5  # plausible: no method here is of more than second order
ORDER_MARGIN = 0.5  # largest difference between observed and theoretical order, else the runs are too coarse


@dataclass(frozen=True, slots=True)
class Error:
    """Error of a quantity.

    Attributes:
        value: Relative error.
        against: Reference, for readers.
        order: Observed order of the extrapolation that gave the reference; None without an extrapolation.
    """

    value: float
    against: str
    order: float | None = None


Quantities = Mapping[str, Quantity]


def compute_errors(
    results: Mapping[str, Quantities], runs: Sequence[StudyRun], main: Sequence[StudyRun], order: float | None
) -> dict[str, dict[str, Error]]:
    """Compute the errors of all runs.

    Args:
        results: Name of a completed run -> its quantities.
        runs: All runs.
        main: Runs of the first parameter, the coarsest first.
        order: Theoretical order of the error in that parameter; None without theory.

    Returns:
        Name of run -> quantity -> error. A reference run has no error, nor has a run whose value is not finite.
    """
    errors: dict[str, dict[str, Error]] = {}
    for run in runs:
        for name, quantity in results.get(run.name, {}).items():
            if quantity.exact is not None and not run.against:
                error: Error | None = _error_from_exact(quantity, quantity.exact)
            else:
                error = _error_from_run(name, run, results, _Reference.select(name, run, results, main, order))
            if error is not None and math.isfinite(error.value):
                errors.setdefault(run.name, {})[name] = error
    return errors


@dataclass(frozen=True, slots=True)
class _Reference:
    """Reference of a comparison: its value, its description, and the name of its run if it is one run."""

    value: Values
    description: str
    run: str = ""
    order: float | None = None

    @classmethod
    def select(
        cls,
        quantity: str,
        run: StudyRun,
        results: Mapping[str, Quantities],
        main: Sequence[StudyRun],
        order: float | None,
    ) -> "_Reference | None":
        """Return the named run, else an extrapolation of the three finest main runs, else the finest main run."""
        # A value with an exact solution may be an error that the run computed itself: not comparable.
        comparable = [m for m in main if (value := results.get(m.name, {}).get(quantity)) and value.exact is None]
        if run.against:
            named = results.get(run.against, {}).get(quantity)
            return None if named is None else cls(named.value, f"run {run.against}", run.against)
        if not comparable:
            return None
        values = [results[main_run.name][quantity].value for main_run in comparable]
        limit = richardson([main_run.value or 0.0 for main_run in comparable[-3:]], values[-3:], order)
        if limit is not None:
            return cls(limit[0], f"Richardson, order {limit[1]:.3g}", order=limit[1])
        return cls(values[-1], f"finest run, {comparable[-1].name}", comparable[-1].name)


def _error_from_exact(quantity: Quantity, exact: Values) -> Error:
    return Error(_difference(quantity, exact), f"exact: {quantity.source}" if quantity.source else "exact")


def _error_from_run(
    quantity: str, run: StudyRun, results: Mapping[str, Quantities], reference: _Reference | None
) -> Error | None:
    if reference is None or reference.run == run.name:
        return None
    return Error(_difference(results[run.name][quantity], reference.value), reference.description, reference.order)


def _difference(quantity: Quantity, other: Values) -> float:
    """Return the Euclidean norm of a difference, divided by the scale or by the norm of ``other``; nan if that is 0."""
    scale = _norm(other) if quantity.scale is None else quantity.scale
    return _norm(np.asarray(quantity.value) - np.asarray(other)) / scale if scale else math.nan


def _norm(values: Values) -> float:
    return float(np.linalg.norm(np.atleast_1d(np.asarray(values))))


def richardson(sizes: Sequence[float], values: Sequence[Values], order: float | None) -> tuple[Values, float] | None:
    """Extrapolate the values of three runs to size zero (Richardson).

    Args:
        sizes: Sizes of mesh, spacing or time step, the coarsest first.
        values: Computed values, one per size.
        order: Theoretical order, which the observed one must match within 0.5; None accepts any order.

    Returns:
        The limit and the observed order; None if the runs show no order.
    """
    if len(sizes) != 3 or not sizes[0] > sizes[1] > sizes[2] > 0.0:
        return None
    coarse, fine = (np.asarray(values[k]) - np.asarray(values[k + 1]) for k in (0, 1))
    if np.sum(coarse * fine) <= 0.0:
        return None  # the values oscillate
    observed = observed_order(sizes, _norm(coarse) / _norm(fine), ORDER_MARGIN, LARGEST_ORDER)
    if observed is None or (order is not None and abs(observed - order) > ORDER_MARGIN):
        return None
    return values[2] - fine / ((sizes[1] / sizes[2]) ** observed - 1.0), observed
