"""Division by step levels: the macro model takes the window, the meso model is all that needs smaller steps."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.choose_levels import SUBSTEP_COST, Pace, choose_levels
from reflowshock.fem.division.division import Division
from reflowshock.fem.division.rules import Rules
from reflowshock.fem.division.whole import Survey, Whole
from reflowshock.fem.errors import LevelError
from reflowshock.fem.estimates.estimate import (
    BOARD_ADVANTAGE,
    UPDATES_PER_SECOND,
    WINDOW_OVERHEAD,
    damped_critical_step,
)

# Of the coarse cells, those that may need less than the window: none, a few at the walls of holes, the finer half.
EXCEPTIONS = (0.0, 0.02, 0.5)
SHARES = (1.0, 1.0 / 1.5, 0.5)  # of these windows: on packages the largest is within 5 % of the best there is
WINDOW_COST = WINDOW_OVERHEAD * UPDATES_PER_SECOND * BOARD_ADVANTAGE  # in updates of a box


def by_levels(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Choose window and levels of least predicted cost: local steps.

    Raises:
        LevelError: No window allows levels.
    """
    critical = damped_critical_step(survey.step, rules.stiffness)
    found, failure = [], LevelError("no window was tried")
    for step in window_steps(critical[rules.coarse if rules.coarse.any() else ...]):
        try:
            found.append(levels_below(whole, survey, step, rules))
        except LevelError as error:
            failure = error
    if not found:
        raise failure
    useful = [division for division in found if division.meso.any() and division.macro.any()]
    return min(useful or found, key=lambda division: predicted_cost(division, survey.cost))


def window_steps(coarse: NDArray[np.float64]) -> Iterator[float]:
    """Yield critical steps [s] of which the window may be the allowed fraction, from those of coarse cells."""
    natural = np.quantile(coarse, EXCEPTIONS, method="lower")
    yield from np.unique(np.outer(natural, SHARES)).tolist()


def levels_below(whole: Whole, survey: Survey, step: float, rules: Rules) -> Division:
    """Return the division of the window that follows a critical step [s]; errors as ``choose_levels``."""
    plan, most = rules.plan(step, step), rules.coupling.most_levels
    pace = Pace(survey.step, survey.cost, plan.window, rules.fraction, rules.stiffness)
    level, ratios = choose_levels(whole.mesh.cells, whole.tie, pace, most)
    plan = replace(plan, substeps=math.prod(ratios))
    return Division("local_steps", level == 0, level > 0, level, ratios, plan)


def predicted_cost(division: Division, cost: NDArray[np.float64]) -> float:
    """Return the cost of a second of simulated time in updates of a box, ``cost (ne,)`` that of an update."""
    counts = np.cumprod([1, *division.ratios])
    updates = float(cost @ counts[division.level]) + SUBSTEP_COST * float(counts[1:].sum())
    return (updates + WINDOW_COST) / division.plan.window
