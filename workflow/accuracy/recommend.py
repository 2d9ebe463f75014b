"""Recommend settings: the cheapest within a tolerance, or the most accurate within a budget.

Candidates are the measured runs and, where error and cost follow a fit, values between and slightly beyond them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from reflowshock.workflow.convergence.accuracy_file import Fit, Measurement, Recommended
from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy, StudyRun


@dataclass(frozen=True, slots=True)
class Goal:
    """Goal of a recommendation.

    Attributes:
        tolerance: Tolerance of the judged error; None to minimise the error.
        core_seconds: Largest cost of a run that is not measured yet [s]; infinite without a limit.
    """

    tolerance: float | None
    core_seconds: float = float("inf")


@dataclass(frozen=True, slots=True)
class Candidate:
    """Candidate for the recommendation.

    Attributes:
        run: Run with its settings.
        error: Measured error where the run exists, otherwise the error predicted by the fit.
        bound: Upper bound of the error: the prediction times the scatter of the fit.
        core_seconds: Measured or predicted cost [s].
        measured: Whether the run exists.
    """

    run: StudyRun
    error: float
    bound: float
    core_seconds: float
    measured: bool


def recommend(
    study: ConvergenceStudy, measurements: Mapping[str, Measurement], fits: Mapping[str, Fit], goal: Goal
) -> Recommended | None:
    """Recommend settings, measured or interpolated between measured ones.

    Args:
        study: Convergence study with its varied parameters and its choices, such as solver or scheme.
        measurements: Name of run -> its errors and costs.
        fits: Parameter -> fits of error and cost over its values.
        goal: Largest error (then the cheapest settings are sought), or None and the largest cost of a run
            [core-seconds] (then the most accurate ones).

    Returns:
        Recommendation with the error and cost that the fits predict; for a choice without a size, with the measured
        ones. None if no candidate is affordable.
    """
    candidates = [*_measured_runs(study, measurements), *_interpolated_runs(study, measurements, fits, goal)]
    affordable = [c for c in candidates if c.measured or c.core_seconds <= goal.core_seconds]
    if not affordable:
        return None
    accurate = [c for c in affordable if goal.tolerance is not None and c.bound <= goal.tolerance]
    if accurate:
        chosen, why = min(accurate, key=lambda c: c.core_seconds), "the cheapest setting within the tolerance"
    else:
        chosen = min(affordable, key=lambda c: c.bound)
        why = "the most accurate setting" + (" within the budget" if goal.core_seconds < float("inf") else "")
        why += "" if goal.tolerance is None else "; no setting is within the tolerance"
    source = "measured" if chosen.measured else _relation_to_measured(chosen.run, measurements)
    error, cost = _predicted(chosen, fits, study.judged)
    return Recommended(chosen.run, f"{why}, {source}", error, cost)


def _relation_to_measured(run: StudyRun, measurements: Mapping[str, Measurement]) -> str:
    finest = min(m.value for m in measurements.values() if m.parameter == run.parameter and m.value)
    return "between measured points" if run.value and run.value >= finest else "finer than all measured points"


def _measured_runs(study: ConvergenceStudy, measurements: Mapping[str, Measurement]) -> Iterator[Candidate]:
    for run in study.runs:
        measurement = measurements.get(run.name)
        if measurement is not None and study.judged in measurement.errors and not run.against:
            error = measurement.errors[study.judged].value
            yield Candidate(run, error, error, measurement.core_seconds, True)


def _interpolated_runs(
    study: ConvergenceStudy, measurements: Mapping[str, Measurement], fits: Mapping[str, Fit], goal: Goal
) -> Iterator[Candidate]:
    """Yield the value of each parameter with fits at which the goal is just met."""
    for parameter in study.parameters:
        fit = fits[parameter.name]
        error, cost = fit.errors.get(study.judged), fit.cost
        if error is None or cost is None:
            continue
        measured = [m for run in parameter.runs if (m := measurements.get(run.name)) and not m.failed]
        values = [measurement.value for measurement in measured if measurement.value]
        largest, smallest = max(values), min(values) / parameter.extent
        if goal.tolerance is not None:
            target = error.value_for(goal.tolerance)
        else:
            target = _finest_affordable(min(values), parameter.extent, fit, goal.core_seconds)
        if not target >= smallest:
            continue
        run = parameter.run_at(min(target, largest))
        if (
            not run.against
            and run.value is not None
            and smallest <= run.value <= largest
            and run.name not in measurements
        ):
            expected = error.at(run.value)
            yield Candidate(run, expected, expected * error.scatter, cost.at(run.value), False)


def _finest_affordable(finest: float, extent: float, fit: Fit, limit: float) -> float:
    """Return the smallest value within a cost limit [core-seconds]; without a limit the finest measured value.

    Args:
        finest: Finest measured value.
        extent: Factor by which the value may be smaller than the finest one.
        fit: Fits over the parameter.
        limit: Cost limit [core-seconds].
    """
    cost = fit.cost
    if cost is None or limit == float("inf"):
        return finest
    if limit <= cost.start or cost.constant <= 0.0:
        return float("nan")
    return max((cost.constant / (limit - cost.start)) ** (1.0 / cost.exponent), finest / extent)


def _predicted(chosen: Candidate, fits: Mapping[str, Fit], judged: str) -> tuple[float, float]:
    """Return error and cost predicted by the fits of the parameter, or the measured ones without fits."""
    fit, value = fits.get(chosen.run.parameter), chosen.run.value
    if fit is None or value is None or judged not in fit.errors or fit.cost is None:
        return chosen.error, chosen.core_seconds
    return fit.errors[judged].at(value), fit.cost.at(value)
