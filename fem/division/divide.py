"""Division of a mesh into models, levels and windows, from its cells and their critical steps."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.choose_levels import SUBSTEP_COST, StepLimits
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
SHARES = (1.0, 1.0 / 1.5, 0.5)  # fractions of these windows to try; for packages the first is within 5 % of the best
WINDOW_COST = WINDOW_OVERHEAD * UPDATES_PER_SECOND * BOARD_ADVANTAGE  # in updates of a box


def divide(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Divide a mesh into macro and meso model: choose scheme, cells, step levels and window.

    The result is not checked yet; ``checks.check_division`` does that.

    Args:
        whole: Joined mesh of both models with its ties.
        survey: Critical steps, costs and linearity of its cells.
        rules: Settings of the division.

    Returns:
        Division: scheme with its reason, masks of the cells of each model, level of each cell, windows and substeps.

    Raises:
        CouplingError: Local steps are set, and supports have springs.
        LevelError: The critical steps differ by more than the levels allow.
    """
    choice = scheme_for(whole, survey, rules)
    if rules.copied is not None and rules.copy is not None:
        return replace(_divide_for_one_way(whole, survey, rules, rules.copied, rules.copy), why=choice.why)
    divided = {
        "held_velocity": _divide_for_held_velocity,
        "impulse": _divide_for_impulse,
        "gravouil_combescure": _divide_for_gravouil_combescure,
        "local_steps": _divide_for_local_steps,
    }
    return replace(divided[choice.scheme](whole, survey, rules), why=choice.why)


def scheme_for(whole: Whole, survey: Survey, rules: Rules) -> Choice:
    """Return the coupling scheme for a joined mesh, with the reason as text.

    Args:
        whole: Joined mesh of both models with its ties.
        survey: Critical steps and linearity of its cells.
        rules: Settings; ``coupling.scheme`` other than "auto" is returned unchanged.

    Returns:
        Name of the scheme and the reason as text.

    Raises:
        CouplingError: Local steps are set, and supports have springs.
    """
    return decide_scheme(
        rules,
        survey.step,
        bool(survey.linear.all()),
        lambda: bool(_buffered_division(whole, survey, rules).macro.any()),
    )


def _buffered_division(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the division of held velocity: the meso model includes layers of board.

    These layers surround all cells that do not belong to the board. The window follows the macro model and all
    cells that touch the interface (PHYSICS 4).
    """
    cells = whole.mesh.cells
    buffer = grow_region(cells, seeds_of(whole, ~rules.coarse), rules.coarse, rules.coupling.buffer_layers)
    return held_velocity_division(whole, survey, rules, ~rules.coarse | buffer)


def _divide_for_held_velocity(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the buffered division, with levels in the meso model if no load or damping forbids them."""
    division = _buffered_division(whole, survey, rules)
    meso = nodes_of(whole.mesh.cells, division.meso, len(whole.mesh.points))
    pushed = rules.pushed or meso[list(rules.shaken)].any()
    if pushed:
        return division

    def around(taken: NDArray[np.bool_]) -> NDArray[np.bool_]:
        nodes = seeds_of(whole, taken)
        nodes[whole.tie.slave[nodes[whole.tie.master].any(axis=1)]] = True
        return division.meso & touching(whole.mesh.cells, nodes)

    limits = StepLimits(survey.step, survey.cost, division.plan.window, rules.fraction)
    return in_path_levels(division, rules, limits, around)


def _divide_for_impulse(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the division of the impulse scheme: the cells of held velocity, the interface in the meso model."""
    return replace(_buffered_division(whole, survey, rules), scheme="impulse")


def held_velocity_division(whole: Whole, survey: Survey, rules: Rules, meso: NDArray[np.bool_]) -> Division:
    """Return the division for the scheme of held velocity with given cells of the meso model.

    Args:
        whole: Joined mesh of both models with its ties.
        survey: Critical steps of its cells.
        rules: Settings of the division.
        meso: Cells of the meso model, shape (ne,); all others form the macro model.

    Returns:
        Division with one step in each model; the window is limited by the macro cells and the cells at the interface.
    """
    slow = ~meso | touching(whole.mesh.cells, cut_nodes(whole.mesh.cells, meso, len(whole.mesh.points)))
    return in_two_steps("held_velocity", ~meso, meso, plan_windows(rules, slow, survey.step))


def _divide_for_one_way(
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
    """Return which nodes belong to cells of both models, shape (count,).

    Args:
        cells: Nodes of each cell, shape (ne, k).
        meso: Cells of the meso model, shape (ne,); all others are macro.
        count: Number of nodes.
    """
    return nodes_of(cells, meso, count) & nodes_of(cells, ~meso, count)


def _divide_for_gravouil_combescure(_whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the division of Gravouil-Combescure: the meso model is everything but the board.

    Both models are coupled at the tied nodes.
    """
    plan = plan_windows(rules, rules.coarse, survey.step)
    return in_two_steps("gravouil_combescure", rules.coarse, ~rules.coarse, plan)


def _divide_for_local_steps(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Return the division of local steps with the window and levels of least predicted cost.

    Raises:
        LevelError: No window allows levels.
    """
    critical = damped_critical_step(survey.step, rules.stiffness)
    divisions, failure = [], LevelError("no window was tried")
    for step in _window_steps(critical[rules.coarse if rules.coarse.any() else ...]):
        try:
            divisions.append(_levels_below(whole, survey, step, rules))
        except LevelError as error:
            failure = error
    if not divisions:
        raise failure
    useful = [division for division in divisions if division.meso.any() and division.macro.any()]
    return min(useful or divisions, key=lambda division: _predicted_cost(division, survey.cost))


def _window_steps(coarse: NDArray[np.float64]) -> Iterator[float]:
    """Yield candidate critical steps for the window [s], from the critical steps of the coarse cells [s]."""
    natural = np.quantile(coarse, EXCEPTIONS, method="lower")
    yield from np.unique(np.outer(natural, SHARES)).tolist()


def _levels_below(whole: Whole, survey: Survey, step: float, rules: Rules) -> Division:
    """Return the division in levels for a window from a critical step [s]; raises as ``choose_levels``."""
    plan = rules.plan(step, step)
    limits = StepLimits(survey.step, survey.cost, plan.window, rules.fraction, rules.stiffness)
    return in_local_steps(whole.mesh.cells, whole.tie, limits, plan, rules.coupling.most_levels)


def _predicted_cost(division: Division, cost: NDArray[np.float64]) -> float:
    """Return the cost per second of simulated time, from the cost of an update of each cell, shape (ne,)."""
    counts = np.cumprod([1, *division.ratios])
    updates = float(cost @ counts[division.level]) + SUBSTEP_COST * float(counts[1:].sum())
    return (updates + WINDOW_COST) / division.plan.window


def grow_region(
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
