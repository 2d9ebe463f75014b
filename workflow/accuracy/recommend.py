"""Which settings to take: the cheapest within a tolerance, or the most accurate within a cost."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from reflowshock.workflow.convergence.measured import Fit, Measurement, Recommended
from reflowshock.workflow.convergence.series import ConvergenceStudy, StudyRun


@dataclass(frozen=True, slots=True)
class Goal:
    """What is wanted.

    Attributes:
        tolerance: of the judged error; None: as small as can be.
        core_seconds: that a run may cost which is still to be made [s]; infinite without a limit.
    """

    tolerance: float | None
    core_seconds: float = float("inf")


@dataclass(frozen=True, slots=True)
class Candidate:
    """Settings that may be chosen.

    Attributes:
        run: the settings.
        error: that is expected; of what was measured, the measured one.
        bound: what the error may be: larger by the scatter of the fit.
        core_seconds: that are expected [s].
        measured: whether it was run.
    """

    run: StudyRun
    error: float
    bound: float
    core_seconds: float
    measured: bool


def recommend(
    study: ConvergenceStudy, measurements: Mapping[str, Measurement], fits: Mapping[str, Fit], goal: Goal
) -> Recommended | None:
    """Choose settings, also between measured ones.

    Args:
        study: what was measured.
        measurements: name of run -> what was found.
        fits: parameter -> how error and cost follow it.
        goal: what is wanted.

    Returns:
        The choice, not yet run, with the error and cost that the fits predict; where it is no value of a parameter,
        with the measured ones. None where nothing is within the cost.
    """
    every = [*_measured(study, measurements), *_between(study, measurements, fits, goal)]
    within = [one for one in every if one.measured or one.core_seconds <= goal.core_seconds]
    if not within:
        return None
    good = [one for one in within if goal.tolerance is not None and one.bound <= goal.tolerance]
    if good:
        chosen, why = min(good, key=lambda one: one.core_seconds), "the cheapest setting within the tolerance"
    else:
        chosen = min(within, key=lambda one: one.bound)
        why = "the most accurate setting" + (" within the budget" if goal.core_seconds < float("inf") else "")
        why += "" if goal.tolerance is None else "; no setting is within the tolerance"
    place = "measured" if chosen.measured else _place(chosen.run, measurements)
    error, cost = _predicted(chosen, fits, study.judged)
    return Recommended(chosen.run, f"{why}, {place}", error, cost)


def _place(run: StudyRun, measurements: Mapping[str, Measurement]) -> str:
    finest = min(one.value for one in measurements.values() if one.parameter == run.parameter and one.value)
    return "between measured points" if run.value and run.value >= finest else "finer than all measured points"


def _measured(study: ConvergenceStudy, measurements: Mapping[str, Measurement]) -> Iterator[Candidate]:
    for run in study.runs:
        found = measurements.get(run.name)
        if found is not None and study.judged in found.errors and not run.against:
            error = found.errors[study.judged].value
            yield Candidate(run, error, error, found.core_seconds, True)


def _between(
    study: ConvergenceStudy, measurements: Mapping[str, Measurement], fits: Mapping[str, Fit], goal: Goal
) -> Iterator[Candidate]:
    """Values of parameters at which the goal is just met, where error and cost are known to follow the parameter."""
    for parameter in study.parameters:
        fit = fits[parameter.name]
        error, cost = fit.errors.get(study.judged), fit.cost
        if error is None or cost is None:
            continue
        runs = [found for run in parameter.runs if (found := measurements.get(run.name)) and not found.failed]
        known = [found.value for found in runs if found.value]
        largest, smallest = max(known), min(known) / parameter.extent
        if goal.tolerance is not None:
            wanted = error.value_for(goal.tolerance)
        else:
            wanted = _finest(min(known), parameter.extent, fit, goal.core_seconds)
        if not wanted >= smallest:
            continue
        run = parameter.at(min(wanted, largest))
        if (
            not run.against
            and run.value is not None
            and smallest <= run.value <= largest
            and run.name not in measurements
        ):
            expected = error.at(run.value)
            yield Candidate(run, expected, expected * error.scatter, cost.at(run.value), False)


def _finest(finest: float, extent: float, fit: Fit, limit: float) -> float:
    """Smallest value whose cost is within a limit [core-seconds], that of the finest known one without a limit."""
    cost = fit.cost
    if cost is None or limit == float("inf"):
        return finest
    if limit <= cost.start or cost.constant <= 0.0:
        return float("nan")
    return max((cost.constant / (limit - cost.start)) ** (1.0 / cost.exponent), finest / extent)


def _predicted(chosen: Candidate, fits: Mapping[str, Fit], judged: str) -> tuple[float, float]:
    """Error and cost by the fits of its parameter, where there are any."""
    fit, value = fits.get(chosen.run.parameter), chosen.run.value
    if fit is None or value is None or judged not in fit.errors or fit.cost is None:
        return chosen.error, chosen.core_seconds
    return fit.errors[judged].at(value), fit.cost.at(value)
