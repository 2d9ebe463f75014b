"""Errors of answers: against an exact one, a chosen run, a Richardson extrapolation, or else the finest run."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reflowshock.workflow.convergence.series import Quantity, StudyRun, Values

LARGEST_ORDER = 2.5  # that is believed: no method here is of more than second order
ORDER_MARGIN = 0.5  # of an observed order from theory, beyond which runs are not yet fine enough to extrapolate from


@dataclass(frozen=True, slots=True)
class Error:
    """Error of an answer, what it was compared with, for readers, and the order by which a limit was found, if any."""

    value: float
    against: str
    order: float | None = None


Answers = Mapping[str, Quantity]


def errors_of(
    answers: Mapping[str, Answers], runs: Sequence[StudyRun], main: Sequence[StudyRun], order: float | None
) -> dict[str, dict[str, Error]]:
    """Find the errors of all runs.

    Args:
        answers: name of a run that came to its end -> its answers.
        runs: all runs.
        main: those of the first parameter, the coarsest first.
        order: of the error in that parameter's value by theory; None without one.

    Returns:
        Name of run -> quantity -> error. A run that others are compared with has none of its own, nor one whose answer
        is not finite.
    """
    found: dict[str, dict[str, Error]] = {}
    for run in runs:
        for quantity, answer in answers.get(run.name, {}).items():
            if answer.exact is not None and not run.against:
                error: Error | None = _exact(answer, answer.exact)
            else:
                error = _compared(quantity, run, answers, _Reference.of(quantity, run, answers, main, order))
            if error is not None and math.isfinite(error.value):
                found.setdefault(run.name, {})[quantity] = error
    return found


@dataclass(frozen=True, slots=True)
class _Reference:
    """What is compared with: its value, in words, and the run that it is, if it is one."""

    value: Values
    words: str
    run: str = ""
    order: float | None = None

    @classmethod
    def of(
        cls,
        quantity: str,
        run: StudyRun,
        answers: Mapping[str, Answers],
        main: Sequence[StudyRun],
        order: float | None,
    ) -> "_Reference | None":
        """Take the named run, else an extrapolation of the three finest of the first parameter, else the finest."""
        # What a run has compared with an exact answer itself may be an error, no answer.
        known = [one for one in main if (own := answers.get(one.name, {}).get(quantity)) and own.exact is None]
        if run.against:
            answer = answers.get(run.against, {}).get(quantity)
            return None if answer is None else cls(answer.value, f"run {run.against}", run.against)
        if not known:
            return None
        values = [answers[one.name][quantity].value for one in known]
        limit = richardson([one.value or 0.0 for one in known[-3:]], values[-3:], order)
        if limit is not None:
            return cls(limit[0], f"Richardson, order {limit[1]:.3g}", order=limit[1])
        return cls(values[-1], f"finest run, {known[-1].name}", known[-1].name)


def _exact(answer: Quantity, exact: Values) -> Error:
    return Error(_difference(answer, exact), f"exact: {answer.source}" if answer.source else "exact")


def _compared(
    quantity: str, run: StudyRun, answers: Mapping[str, Answers], reference: _Reference | None
) -> Error | None:
    if reference is None or reference.run == run.name:
        return None
    return Error(_difference(answers[run.name][quantity], reference.value), reference.words, reference.order)


def _difference(answer: Quantity, other: Values) -> float:
    """Euclidean norm of a difference over the scale, or over that of the other answer; nan where that is nothing."""
    scale = _norm(other) if answer.scale is None else answer.scale
    return _norm(np.asarray(answer.value) - np.asarray(other)) / scale if scale else math.nan


def _norm(values: Values) -> float:
    return float(np.linalg.norm(np.atleast_1d(np.asarray(values))))


def richardson(sizes: Sequence[float], values: Sequence[Values], order: float | None) -> tuple[Values, float] | None:
    """Extrapolate the answers of three runs to size zero (Richardson).

    Args:
        sizes: the coarsest first.
        values: the answers.
        order: by theory; the observed one then has to be within 0.5 of it.

    Returns:
        The limit and the observed order; None where the runs show no order.
    """
    if len(sizes) != 3 or not sizes[0] > sizes[1] > sizes[2] > 0.0:
        return None
    coarse, fine = (np.asarray(values[k]) - np.asarray(values[k + 1]) for k in (0, 1))
    if np.sum(coarse * fine) <= 0.0:
        return None  # the answers oscillate
    ratio = _norm(coarse) / _norm(fine)

    def excess(power: float) -> float:
        return (sizes[0] ** power - sizes[1] ** power) / (sizes[1] ** power - sizes[2] ** power) - ratio

    if excess(ORDER_MARGIN) * excess(LARGEST_ORDER) > 0.0:
        return None
    from scipy.optimize import brentq  # reports and plans start without it

    observed = float(brentq(excess, ORDER_MARGIN, LARGEST_ORDER))
    if order is not None and abs(observed - order) > ORDER_MARGIN:
        return None
    return values[2] - fine / ((sizes[1] / sizes[2]) ** observed - 1.0), observed
