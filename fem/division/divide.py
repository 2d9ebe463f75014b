"""Division of a mesh into models, levels and windows, from its cells and their critical steps."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.choose_levels import SUBSTEP_COST, Pace
from reflowshock.fem.division.decide import decide_scheme, in_local_steps, in_path_levels, in_two_steps, plan_windows
from reflowshock.fem.division.division import Choice, Division, Rules
from reflowshock.fem.division.whole import Survey, Whole, nodes_of, seeds_of, touching
from reflowshock.fem.errors import LevelError
from reflowshock.fem.estimates.estimate import (
    BOARD_ADVANTAGE,
    UPDATES_PER_SECOND,
    WINDOW_OVERHEAD,
    damped_critical_step,
)

# Fraction of coarse cells that may need less than the window: none, a few at the walls of holes, the finer half.
EXCEPTIONS = (0.0, 0.02, 0.5)
SHARES = (1.0, 1.0 / 1.5, 0.5)  # of these windows: on packages the largest is within 5 % of the best there is
WINDOW_COST = WINDOW_OVERHEAD * UPDATES_PER_SECOND * BOARD_ADVANTAGE  # in updates of a box


def divide(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Choose scheme, models, levels and window; ``checks.check_division`` then checks the result.

    Raises:
        LevelError: The critical steps differ by more than the levels allow.
    """
    choice = scheme_for(whole, survey, rules)
    if rules.copied is not None and rules.copy is not None:
        return replace(submodel(whole, survey, rules, rules.copied, rules.copy), why=choice.why)
    divided = {
        "held_velocity": along_paths,
        "impulse": carried,
        "gravouil_combescure": at_ties,
        "local_steps": by_levels,
    }
    return replace(divided[choice.scheme](whole, survey, rules), why=choice.why)


def scheme_for(whole: Whole, survey: Survey, rules: Rules) -> Choice:
    """Return the scheme for a mesh, with the reason; raises as ``decide_scheme``."""
    return decide_scheme(
        rules, survey.step, bool(survey.linear.all()), lambda: bool(by_buffer(whole, survey, rules).macro.any())
    )


def by_buffer(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the division of held velocity: the meso model is all but the board, plus layers of board around it.

    The window follows the macro model and all cells that touch the interface (PHYSICS 4).
    """
    cells = whole.mesh.cells
    buffer = grown(cells, seeds_of(whole, ~rules.coarse), rules.coarse, rules.coupling.buffer_layers)
    return held(whole, survey, rules, ~rules.coarse | buffer)


def along_paths(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the division of ``by_buffer``, with levels in the meso model unless a load or damping forbids them."""
    division = by_buffer(whole, survey, rules)
    meso = nodes_of(whole.mesh.cells, division.meso, len(whole.mesh.points))
    pushed = rules.pushed or meso[list(rules.shaken)].any()
    if pushed:
        return division

    def around(taken: NDArray[np.bool_]) -> NDArray[np.bool_]:
        nodes = seeds_of(whole, taken)
        nodes[whole.tie.slave[nodes[whole.tie.master].any(axis=1)]] = True
        return division.meso & touching(whole.mesh.cells, nodes)

    pace = Pace(survey.step, survey.cost, division.plan.window, rules.fraction)
    return in_path_levels(division, rules, pace, around)


def carried(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the division of the impulse scheme: the cells of held velocity, the interface in the meso model."""
    return replace(by_buffer(whole, survey, rules), scheme="impulse")


def held(whole: Whole, survey: Survey, rules: Rules, meso: NDArray[np.bool_]) -> Division:
    """Return the division of held velocity for the cells of the meso model, shape (ne,)."""
    slow = ~meso | touching(whole.mesh.cells, cut_nodes(whole.mesh.cells, meso, len(whole.mesh.points)))
    return in_two_steps("held_velocity", ~meso, meso, plan_windows(rules, slow, survey.step))


def submodel(
    whole: Whole, survey: Survey, rules: Rules, copied: NDArray[np.bool_], copy: NDArray[np.bool_]
) -> Division:
    """Return the division of one-way coupling: the meso model has the fine cells and layers of cells around them.

    The macro model has the whole structure with coarse copies of the fine cells. Layers grow through ties, too, so
    another joint on the same element is part of the meso model with its coarse mesh.
    """
    cells, meso = whole.mesh.cells, copied.copy()
    for _ in range(rules.coupling.buffer_layers):
        nodes = seeds_of(whole, meso)
        nodes[whole.tie.slave[nodes[whole.tie.master].any(axis=1)]] = True
        meso |= ~copied & ~copy & touching(cells, nodes)
    plan = plan_windows(rules, ~copied, survey.step)
    return replace(in_two_steps("held_velocity", ~copied, meso, plan), copy=copy)


def cut_nodes(cells: NDArray[np.int32], meso: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Return which of ``count`` nodes belong to cells of both models, shape (count,)."""
    return nodes_of(cells, meso, count) & nodes_of(cells, ~meso, count)


def at_ties(_whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the division of Gravouil-Combescure: the meso model is all but the board, coupled at the tied nodes."""
    plan = plan_windows(rules, rules.coarse, survey.step)
    return in_two_steps("gravouil_combescure", rules.coarse, ~rules.coarse, plan)


def by_levels(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the division of local steps with the window and levels of least predicted cost.

    Raises:
        LevelError: No window allows levels.
    """
    critical = damped_critical_step(survey.step, rules.stiffness)
    divisions, failure = [], LevelError("no window was tried")
    for step in window_steps(critical[rules.coarse if rules.coarse.any() else ...]):
        try:
            divisions.append(levels_below(whole, survey, step, rules))
        except LevelError as error:
            failure = error
    if not divisions:
        raise failure
    useful = [division for division in divisions if division.meso.any() and division.macro.any()]
    return min(useful or divisions, key=lambda division: predicted_cost(division, survey.cost))


def window_steps(coarse: NDArray[np.float64]) -> Iterator[float]:
    """Yield candidate critical steps for the window [s], from the critical steps of the coarse cells [s]."""
    natural = np.quantile(coarse, EXCEPTIONS, method="lower")
    yield from np.unique(np.outer(natural, SHARES)).tolist()


def levels_below(whole: Whole, survey: Survey, step: float, rules: Rules) -> Division:
    """Return the division in levels for a window from a critical step [s]; raises as ``choose_levels``."""
    plan = rules.plan(step, step)
    pace = Pace(survey.step, survey.cost, plan.window, rules.fraction, rules.stiffness)
    return in_local_steps(whole.mesh.cells, whole.tie, pace, plan, rules.coupling.most_levels)


def predicted_cost(division: Division, cost: NDArray[np.float64]) -> float:
    """Return the cost per second of simulated time, from the cost of an update of each cell, shape (ne,)."""
    counts = np.cumprod([1, *division.ratios])
    updates = float(cost @ counts[division.level]) + SUBSTEP_COST * float(counts[1:].sum())
    return (updates + WINDOW_COST) / division.plan.window


def grown(
    cells: NDArray[np.int32], seeds: NDArray[np.bool_], through: NDArray[np.bool_], layers: int
) -> NDArray[np.bool_]:
    """Return the cells of several layers around seed nodes, shape (ne,); each layer touches the previous one.

    Args:
        cells: Nodes of each cell, shape (ne, k).
        seeds: Nodes that the first layer touches, shape (n,).
        through: Cells that a layer may contain, shape (ne,).
        layers: Number of layers.
    """
    taken = np.zeros(len(cells), dtype=bool)
    for _ in range(layers):
        taken |= through & touching(cells, seeds)
        seeds = seeds | nodes_of(cells, taken, len(seeds))
    return taken
