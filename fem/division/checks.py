"""Checks of a division: non-empty models, buffer layers, stable steps, resolved pulses."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.chebyshev import LARGEST_DAMPING
from reflowshock.fem.division.choose_levels import StepLimits, least_steps
from reflowshock.fem.division.divide import cut_nodes, grow_region
from reflowshock.fem.division.division import BUFFERED, Division, Rules
from reflowshock.fem.division.whole import Survey, Whole, seeds_of, touching
from reflowshock.fem.errors import CouplingError, PulseError
from reflowshock.fem.estimates.estimate import damped_critical_step

ROUNDING = 1e-9


def check_division(whole: Whole, survey: Survey, division: Division, rules: Rules) -> None:
    """Check that the models of a division are not empty and that all its steps are stable.

    Args:
        whole: Joined mesh with its ties.
        survey: Critical steps, masses and roles of the cells of this mesh.
        division: Cells of each model, step levels and window to check.
        rules: Settings from which the division was made.

    Raises:
        CouplingError: A model is empty, a step is unstable, or the buffer is too thin or not part of the board.
    """
    for role, cells in (("macro", division.macro), ("meso", division.meso)):
        if not cells.any():
            raise CouplingError(_empty_model_message(role, whole, rules))
    if division.scheme in BUFFERED and not division.overlaps:
        _check_buffer(whole, survey, division, rules)
    if division.scheme == "local_steps":
        _check_linear(survey, division, rules)
    _check_steps(whole, survey, division, rules)


def _empty_model_message(role: str, whole: Whole, rules: Rules) -> str:
    """Return why a model has no cell, and possible remedies, as text."""
    if role == "meso":
        return (
            "mode = two_scale needs elements that are finer than the board; the mesh has the parts"
            f" {', '.join(whole.mesh.part_names)} and {len(whole.tie.slave)} tied nodes; use mode = dns"
        )
    return (
        f"the macro model is empty: all board elements are within {rules.coupling.buffer_layers} layers of the joints"
        " (coupling.buffer_layers); use fewer layers, a larger board, smaller elements, or scheme ="
        " gravouil_combescure, which needs no buffer"
    )


def _check_buffer(whole: Whole, survey: Survey, division: Division, rules: Rules) -> None:
    """Check that layers of board separate the interface from finer cells; raises as ``check_division``.

    A joint on an element that touches the interface makes the window unstable (tests/stability/test_fem_window.py), and
    so do stiff elements that touch it (PHYSICS 4).
    """
    cells = whole.mesh.cells
    at_interface = touching(cells, cut_nodes(cells, division.meso, len(whole.mesh.points)))
    foreign = at_interface & ~rules.coarse
    if foreign.any():
        roles = ", ".join(np.unique(survey.role[foreign]).tolist())
        raise CouplingError(
            f"elements that touch the interface must belong to the board, found {np.sum(foreign)} of {roles}, the first"
            f" {_location_of(whole, foreign)}; try coupling.scheme = local_steps, which allows this interface"
        )
    layers = rules.coupling.buffer_layers
    close = division.macro & grow_region(cells, seeds_of(whole, ~rules.coarse), rules.coarse, layers)
    if close.any():
        raise CouplingError(
            f"{np.sum(close)} elements of the macro model are too close to the joints, the first"
            f" {_location_of(whole, close)}: at least two layers of board elements must lie between"
            f" (coupling.buffer_layers = {layers})"
        )


def _check_linear(survey: Survey, division: Division, rules: Rules) -> None:
    """Check that elements with local steps are linear and lightly damped; raises as ``check_division``."""
    unsupported = division.meso & ~survey.linear
    if unsupported.any():
        roles = ", ".join(np.unique(survey.role[unsupported]).tolist())
        raise CouplingError(
            f"coupling.scheme = local_steps supports only linear elastic elements at small strains, but"
            f" {np.sum(unsupported)} elements of {roles} are not; use held_velocity or gravouil_combescure"
        )
    largest = LARGEST_DAMPING * division.plan.window
    if rules.stiffness > largest:
        raise CouplingError(
            f"stiffness-proportional damping of {rules.stiffness:.3g} s is too large for coupling.scheme = local_steps"
            f" with a window of {division.plan.window:.3g} s; use at most {largest:.3g} s, or scheme = held_velocity"
        )


def _check_steps(whole: Whole, survey: Survey, division: Division, rules: Rules) -> None:
    """Check every step against the critical steps of its elements; raises as ``check_division``."""
    for name, step, cells, critical in steps_of(whole, survey, division, rules):
        above = cells & (step > (1.0 + ROUNDING) * rules.fraction * critical)
        if above.any():
            lowest = float(critical[above].min())
            raise CouplingError(
                f"{name} of {step:.4g} s is above step_fraction = {rules.fraction:g} of the critical step of"
                f" {np.sum(above)} elements ({', '.join(np.unique(survey.role[above]).tolist())}), the first"
                f" {_location_of(whole, above)}: at most {rules.fraction * lowest:.4g} s is stable"
            )


def steps_of(
    whole: Whole, survey: Survey, division: Division, rules: Rules
) -> Iterator[tuple[str, float, NDArray[np.bool_], NDArray[np.float64]]]:
    """Yield all time steps of a division, each with the cells that limit it.

    Args:
        whole: Joined mesh of both models with its ties.
        survey: Critical steps of its cells [s].
        division: Cells of each model, step levels and window (coupling interval).
        rules: Settings from which the division was made, with the ratio of step to critical step.

    Yields:
        Name of the step for messages, its size [s], mask of the cells that take it, shape (ne,), and the largest stable
        step of every cell, shape (ne,) [s], of which only the masked ones count.
    """
    cells, plan = whole.mesh.cells, division.plan
    if division.scheme == "local_steps":
        limits = StepLimits(survey.step, survey.cost, plan.window, rules.fraction, rules.stiffness)
        steps = plan.window / division.counts
        shares = steps / least_steps(division.ratios, limits)  # usable fraction of a critical step at each level
        for level, (step, share) in enumerate(zip(steps.tolist(), shares.tolist(), strict=True)):
            yield f"the step of level {level}", step, division.level == level, share * survey.step
        return
    critical, slow = damped_critical_step(survey.step, rules.stiffness), division.macro
    if division.scheme in BUFFERED and not division.overlaps:
        slow = slow | touching(cells, cut_nodes(cells, division.meso, len(whole.mesh.points)))
    yield "the window", plan.window, slow, critical
    for level, count in enumerate(division.counts[1:].tolist(), 1):
        yield "the step", plan.window / count, division.meso & (division.level == level), critical


def check_pulses(durations: Iterable[float], window: float, fraction: float) -> None:
    """Check that no pulse is shorter than a window, the time between two exchanges of macro and meso model.

    Args:
        durations: Durations of the pulses [s].
        window: Coupling window [s].
        fraction: Window over critical step (``numerics.step_fraction``), for the message.

    Raises:
        PulseError: A pulse is shorter than a window.
    """
    shortest = min(durations, default=np.inf)
    if shortest < window:
        raise PulseError(
            f"a pulse of {shortest:.4g} s is shorter than a window of {window:.4g} s, after which the models exchange"
            f" data; use a step_fraction below {fraction * shortest / window:.3g}, or a single model (dns)"
        )


def _location_of(whole: Whole, cells: NDArray[np.bool_]) -> str:
    """Return the centre of the first selected cell as text."""
    centre = whole.mesh.points[whole.mesh.cells[np.argmax(cells)]].mean(axis=0)
    return f"near ({', '.join(f'{value:.6g}' for value in centre)}) m"
