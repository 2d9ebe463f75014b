"""Which settings to take: the cheapest within a tolerance, or the most accurate within a cost."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from reflowshock.workflow.convergence.measured import Fit, Measurement, Recommended
from reflowshock.workflow.convergence.series import Ladder, Rung


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
        rung: the settings.
        error: that is expected; of what was measured, the measured one.
        bound: what the error may be: larger by the scatter of the fit.
        core_seconds: that are expected [s].
        measured: whether it was run.
    """

    rung: Rung
    error: float
    bound: float
    core_seconds: float
    measured: bool


def recommend(
    ladder: Ladder, measurements: Mapping[str, Measurement], fits: Mapping[str, Fit], goal: Goal
) -> Recommended | None:
    """Choose settings, also between measured ones.

    Args:
        ladder: what was measured.
        measurements: name of rung -> what was found.
        fits: knob -> how error and cost follow it.
        goal: what is wanted.

    Returns:
        The choice, not yet run, with the error and cost that the fits foresee (of a choice that is no value of a knob,
        those that were measured). None where nothing is within the cost.
    """
    every = [*_measured(ladder, measurements), *_between(ladder, measurements, fits, goal)]
    within = [one for one in every if one.measured or one.core_seconds <= goal.core_seconds]
    if not within:
        return None
    good = [one for one in within if goal.tolerance is not None and one.bound <= goal.tolerance]
    if good:
        chosen, why = min(good, key=lambda one: one.core_seconds), "the cheapest within the tolerance"
    else:
        chosen = min(within, key=lambda one: one.bound)
        why = "the most accurate" + (" within the budget" if goal.core_seconds < float("inf") else "")
        why += "" if goal.tolerance is None else "; none is within the tolerance"
    place = "measured" if chosen.measured else _place(chosen.rung, measurements)
    error, cost = _foreseen(chosen, fits, ladder.judged)
    return Recommended(chosen.rung, f"{why}, {place}", error, cost)


def _place(rung: Rung, measurements: Mapping[str, Measurement]) -> str:
    finest = min(one.value for one in measurements.values() if one.knob == rung.knob and one.value)
    return "between measured points" if rung.value and rung.value >= finest else "finer than all measured points"


def _measured(ladder: Ladder, measurements: Mapping[str, Measurement]) -> Iterator[Candidate]:
    for rung in ladder.rungs:
        found = measurements.get(rung.name)
        if found is not None and ladder.judged in found.errors and not rung.against:
            error = found.errors[ladder.judged].value
            yield Candidate(rung, error, error, found.core_seconds, True)


def _between(
    ladder: Ladder, measurements: Mapping[str, Measurement], fits: Mapping[str, Fit], goal: Goal
) -> Iterator[Candidate]:
    """Values of knobs at which the goal is just met, where error and cost are known to follow the knob."""
    for knob in ladder.knobs:
        fit = fits[knob.name]
        error, cost = fit.errors.get(ladder.judged), fit.cost
        if error is None or cost is None:
            continue
        runs = [found for rung in knob.rungs if (found := measurements.get(rung.name)) and not found.failed]
        known = [found.value for found in runs if found.value]
        largest, smallest = max(known), min(known) / knob.extent
        if goal.tolerance is not None:
            wanted = error.value_for(goal.tolerance)
        else:
            wanted = _finest(min(known), knob.extent, fit, goal.core_seconds)
        if not wanted >= smallest:
            continue
        rung = knob.at(min(wanted, largest))
        if (
            not rung.against
            and rung.value is not None
            and smallest <= rung.value <= largest
            and rung.name not in measurements
        ):
            expected = error.at(rung.value)
            yield Candidate(rung, expected, expected * error.scatter, cost.at(rung.value), False)


def _finest(finest: float, extent: float, fit: Fit, limit: float) -> float:
    """Smallest value whose cost is within a limit [core-seconds], that of the finest known one without a limit."""
    cost = fit.cost
    if cost is None or limit == float("inf"):
        return finest
    if limit <= cost.start or cost.constant <= 0.0:
        return float("nan")
    return max((cost.constant / (limit - cost.start)) ** (1.0 / cost.exponent), finest / extent)


def _foreseen(chosen: Candidate, fits: Mapping[str, Fit], judged: str) -> tuple[float, float]:
    """Error and cost by the fits of its knob, where there are any."""
    fit, value = fits.get(chosen.rung.knob), chosen.rung.value
    if fit is None or value is None or judged not in fit.errors or fit.cost is None:
        return chosen.error, chosen.core_seconds
    return fit.errors[judged].at(value), fit.cost.at(value)
