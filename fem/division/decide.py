"""Decisions on scheme, windows and step levels, from critical steps and costs of cells alone.

``divide`` decides for the cells of a mesh. ``divide_estimate`` decides for a mesh that is not built yet, in which each
part, or each layer of a part, counts as one cell. The module loads no compiled code, so that ``plan`` can use it.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.chebyshev import LARGEST_DAMPING
from reflowshock.fem.division.choose_levels import StepLimits, choose_levels
from reflowshock.fem.division.division import Choice, Division, Rules, SchemeName, choose_scheme
from reflowshock.fem.division.path_levels import Around, with_path_levels
from reflowshock.fem.errors import CouplingError
from reflowshock.fem.estimates.estimate import WindowPlan, damped_critical_step
from reflowshock.fem.mesh.tie import Tie


@dataclass(frozen=True, slots=True)
class MeshEstimate:
    """Parts of a mesh that is not built yet; each row is a part or a layer of a part.

    Attributes:
        names: Part of each row.
        elements: Elements of each row, shape (n,).
        steps: Critical step of each row with mass scaling, shape (n,) [s].
        cost: Cost of an update of all elements of each row, in updates of a box, shape (n,).
        linear: Whether all forces are linear in the displacement.
        macro: Rows of the macro model where each model takes one step, shape (n,).
        touching: Which rows share nodes, shape (n, n).
    """

    names: Sequence[str]
    elements: NDArray[np.int64]
    steps: NDArray[np.float64]
    cost: NDArray[np.float64]
    linear: bool
    macro: NDArray[np.bool_]
    touching: NDArray[np.bool_]


def decide_scheme(rules: Rules, steps: NDArray[np.float64], linear: bool, has_buffer: Callable[[], bool]) -> Choice:
    """Return the coupling scheme that the user sets or that the problem calls for, with the reason.

    One-way coupling uses ``held_velocity``; a scheme set by the user stays; with "auto", linear models without springs
    and with little stiffness-proportional damping use ``local_steps``, others the scheme of ``division.choose_scheme``.

    Args:
        rules: Settings of the division: coupling, supports and damping.
        steps: Critical steps of all cells, shape (ne,) [s].
        linear: Whether all forces are linear in the displacement.
        has_buffer: Function without arguments that returns whether layers of board fit between the joints and the macro
            model; called only for "auto".

    Returns:
        Name of the scheme and the reason as text.

    Raises:
        CouplingError: Local steps are set, and supports have springs.
    """
    setting = rules.coupling.scheme
    if setting == "local_steps" and rules.sprung:
        raise CouplingError(
            "coupling.scheme = local_steps does not support springs at supports; use held_velocity or impulse"
        )
    if rules.copied is not None:
        return Choice("held_velocity", "coupling.direction = one_way: without feedback nothing becomes unstable")
    if setting != "auto":
        return Choice(setting, f"coupling.scheme = {setting}")
    board_step = float(steps[rules.coarse].min(initial=np.inf))
    lightly_damped = rules.stiffness <= LARGEST_DAMPING * rules.fraction * board_step
    choice = choose_scheme(linear and lightly_damped and not rules.sprung, has_buffer())
    if linear and rules.sprung:
        return Choice(choice.scheme, "local steps do not support springs at supports")
    if linear and not lightly_damped:
        return Choice(
            choice.scheme, f"stiffness-proportional damping of {rules.stiffness:.3g} s is too large for local steps"
        )
    return choice


def plan_windows(rules: Rules, slow: NDArray[np.bool_], steps: NDArray[np.float64]) -> WindowPlan:
    """Return windows and substeps of two models that take one step each.

    A window is the time between two exchanges of the models and the step of the macro model.

    Args:
        rules: Rules of the division, with duration, samples and step over critical step.
        slow: Cells that take the window as their step, shape (ne,); if none does, all cells limit the window.
        steps: Critical steps of all cells, shape (ne,) [s].

    Returns:
        Window [s], meso steps per window, number of windows, and windows per history sample.
    """
    damped = damped_critical_step(steps, rules.stiffness)
    return rules.plan(float(damped[slow if slow.any() else ...].min()), float(damped.min()))


def in_two_steps(scheme: SchemeName, macro: NDArray[np.bool_], meso: NDArray[np.bool_], plan: WindowPlan) -> Division:
    """Return the division of a scheme whose models take one step each.

    Args:
        scheme: Name of the coupling scheme.
        macro: Cells of the macro model, shape (ne,).
        meso: Cells of the meso model, shape (ne,).
        plan: Windows (coupling intervals, the steps of the macro model) and substeps (meso steps in a window).

    Returns:
        Division with step level 1 for meso cells and 0 for all others.
    """
    return Division(scheme, macro, meso, meso.astype(np.int32), (plan.substeps,), plan)


def in_local_steps(
    cells: NDArray[np.int32], tie: Tie, limits: StepLimits, plan: WindowPlan, most_levels: int
) -> Division:
    """Return the division in levels of least cost inside a window.

    Args:
        cells: Nodes of the cells, shape (ne, k).
        tie: Tied nodes.
        limits: Critical steps and costs of the cells.
        plan: Windows; the substeps follow from the levels.
        most_levels: Largest number of levels below the window.

    Returns:
        Division with the step level of each cell, the ratios of steps between levels, and the windows.

    Raises:
        LevelError: The critical steps differ by more than the levels allow.
    """
    level, ratios = choose_levels(cells, tie, limits, most_levels)
    return Division("local_steps", level == 0, level > 0, level, ratios, replace(plan, substeps=math.prod(ratios)))


def in_path_levels(division: Division, rules: Rules, limits: StepLimits, around: Around) -> Division:
    """Return a division of held velocity with the step levels of least predicted cost in its meso model.

    The number of levels is at most ``rules.coupling.most_levels``.

    Args:
        division: Division with a single level in the meso model.
        rules: Settings; their coupling limits the number of levels.
        limits: Critical steps [s] and costs of all cells.
        around: Function that takes a mask of cells and returns the mask of the meso cells that share a node with them,
            also through ties, shape (ne,) each.

    Returns:
        Division with the same cells and windows; levels of the meso cells, ratios between levels and substeps are new.
    """
    return with_path_levels(division, limits, around, rules.coupling.most_levels)


def divide_estimate(estimate: MeshEstimate, rules: Rules) -> Division:
    """Return the division of an estimated mesh, whose masks and levels have shape (n,), one for each row.

    Layers of board are assumed to fit around the joints. The window of local steps follows from the board's elements;
    ``divide`` also tries shorter ones.

    Args:
        estimate: Parts of the mesh.
        rules: Rules of the division, whose masks have shape (n,).

    Returns:
        Division: scheme with its reason, masks of the rows in each model, level of each row, windows and substeps.

    Raises:
        CouplingError: Local steps are set, and supports have springs.
        LevelError: The critical steps differ by more than the levels allow.
    """
    choice = decide_scheme(rules, estimate.steps, estimate.linear, lambda: True)
    macro = estimate.macro if rules.copied is None else ~rules.copied
    plan = plan_estimate(estimate, rules)
    limits = StepLimits(estimate.steps, estimate.cost, plan.window, rules.fraction)  # damping changes the levels little
    division = in_two_steps(choice.scheme, macro, ~macro, plan)
    if choice.scheme == "local_steps":
        cells = np.arange(len(estimate.names), dtype=np.int32)[:, None]
        division = in_local_steps(cells, Tie.none(), limits, plan, rules.coupling.most_levels)
    elif choice.scheme == "held_velocity" and rules.copied is None and not rules.pushed:
        division = in_path_levels(
            division, rules, limits, lambda cells: ~macro & (estimate.touching & cells).any(axis=1)
        )
    return replace(division, why=choice.why)


def _slow_rows(rules: Rules) -> NDArray[np.bool_]:
    """Return the rows of an estimated mesh that take the window, shape (n,).

    They are the board, or in one-way coupling all rows of the driving model.
    """
    return rules.coarse if rules.copied is None else ~rules.copied


def plan_estimate(estimate: MeshEstimate, rules: Rules) -> WindowPlan:
    """Return windows and substeps of an estimated mesh.

    Args:
        estimate: Parts of the mesh with their critical steps.
        rules: Rules of the division, whose masks have shape (n,), one entry for each row of the estimate.

    Returns:
        Windows of the two-scale run; the substeps are the steps in a window of a DNS (one model without scales).
    """
    return plan_windows(rules, _slow_rows(rules), estimate.steps)


def longest_window(estimate: MeshEstimate, rules: Rules) -> float:
    """Return the longest window [s] that the elements of an estimated mesh allow, for runs of any duration.

    A window is the time between two exchanges of macro and meso model.

    Args:
        estimate: Parts of the mesh with their critical steps.
        rules: Rules of the division; duration and samples are not used.
    """
    slow = damped_critical_step(estimate.steps[_slow_rows(rules)], rules.stiffness)
    return rules.fraction * float(slow.min())
