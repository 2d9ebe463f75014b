"""What a division must keep so that the coupled models neither grow nor stand still."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.chebyshev import LARGEST_DAMPING
from reflowshock.fem.division.choose_levels import Pace, least_steps
from reflowshock.fem.division.divide import cut_nodes, grown
from reflowshock.fem.division.division import BUFFERED, Division, Rules
from reflowshock.fem.division.whole import Survey, Whole, seeds_of, touching
from reflowshock.fem.errors import CouplingError, PulseError
from reflowshock.fem.estimates.estimate import damped_critical_step

ROUNDING = 1e-9


def check_division(whole: Whole, survey: Survey, division: Division, rules: Rules) -> None:
    """Check models and steps of a division.

    Raises:
        CouplingError: A model without cells, a step above that of its cells, a buffer that is too thin or not of board.
    """
    for role, cells in (("macro", division.macro), ("meso", division.meso)):
        if not cells.any():
            raise CouplingError(nothing_left(role, whole, rules))
    if division.scheme in BUFFERED and not division.overlaps:
        check_buffer(whole, survey, division, rules)
    if division.scheme == "local_steps":
        check_linear(survey, division, rules)
    check_steps(whole, survey, division, rules)


def nothing_left(role: str, whole: Whole, rules: Rules) -> str:
    """Say why a model has no cell, and what to do."""
    if role == "meso":
        return (
            "two_scale needs something finer than the rest: the mesh has the parts"
            f" {', '.join(whole.mesh.part_names)} and {len(whole.tie.slave)} tied nodes; mode dns computes it"
        )
    return (
        f"nothing is left for the macro model: all board elements are among the {rules.coupling.buffer_layers} layers"
        " around the joints (coupling.buffer_layers); fewer layers, a larger board, smaller elements or scheme ="
        " gravouil_combescure, which needs no buffer, leave some"
    )


def check_buffer(whole: Whole, survey: Survey, division: Division, rules: Rules) -> None:
    """Check that layers of board lie between the interface and all that is finer; errors as ``check_division``.

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
            f" {place_of(whole, foreign)}: the interface may be there with scheme = local_steps"
        )
    layers = rules.coupling.buffer_layers
    close = division.macro & grown(cells, seeds_of(whole, ~rules.coarse), rules.coarse, layers)
    if close.any():
        raise CouplingError(
            f"{np.sum(close)} elements of the macro model are too close to the joints, the first"
            f" {place_of(whole, close)}: at least two layers of board elements must lie between"
            f" (coupling.buffer_layers = {layers})"
        )


def check_linear(survey: Survey, division: Division, rules: Rules) -> None:
    """Check that local steps are taken by linear elements, damped little; errors as ``check_division``."""
    path = division.meso & ~survey.linear
    if path.any():
        roles = ", ".join(np.unique(survey.role[path]).tolist())
        raise CouplingError(
            f"coupling.scheme = local_steps is for linear elastic elements at small strains: {np.sum(path)} elements of"
            f" {roles} have a path; held_velocity or gravouil_combescure serve them"
        )
    largest = LARGEST_DAMPING * division.plan.window
    if rules.stiffness > largest:
        raise CouplingError(
            f"stiffness-proportional damping of {rules.stiffness:.3g} s is too large for coupling.scheme = local_steps"
            f" with a window of {division.plan.window:.3g} s: at most {largest:.3g} s, or scheme = held_velocity"
        )


def check_steps(whole: Whole, survey: Survey, division: Division, rules: Rules) -> None:
    """Check every step against the critical step of each element that takes it; errors as ``check_division``."""
    for name, step, cells, critical in steps_of(whole, survey, division, rules):
        above = cells & (step > (1.0 + ROUNDING) * rules.fraction * critical)
        if above.any():
            lowest = float(critical[above].min())
            raise CouplingError(
                f"{name} of {step:.4g} s is above step_fraction = {rules.fraction:g} of the critical step of"
                f" {np.sum(above)} elements ({', '.join(np.unique(survey.role[above]).tolist())}), the first"
                f" {place_of(whole, above)}: at most {rules.fraction * lowest:.4g} s is stable"
            )


def steps_of(
    whole: Whole, survey: Survey, division: Division, rules: Rules
) -> Iterator[tuple[str, float, NDArray[np.bool_], NDArray[np.float64]]]:
    """Yield the name of each step, its size [s], the cells ``(ne,)`` that limit it, and by which step ``(ne,)`` [s]."""
    cells, plan = whole.mesh.cells, division.plan
    if division.scheme == "local_steps":
        pace = Pace(survey.step, survey.cost, plan.window, rules.fraction, rules.stiffness)
        steps = plan.window / division.counts
        shares = steps / least_steps(division.ratios, pace)  # of a critical step that a level may use
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
    """Check that no pulse is over before two models meet again.

    Args:
        durations: Of the loads [s].
        window: The coupling interval [s].
        fraction: Of the critical step that the window is.

    Raises:
        PulseError: A pulse is shorter than a window.
    """
    shortest = min(durations, default=np.inf)
    if shortest < window:
        raise PulseError(
            f"a pulse of {shortest:.4g} s is shorter than a window of {window:.4g} s, the time between two exchanges of"
            f" the models: a step_fraction below {fraction * shortest / window:.3g}, or one model (dns), resolves it"
        )


def place_of(whole: Whole, cells: NDArray[np.bool_]) -> str:
    """Return in words where the first of some cells is."""
    centre = whole.mesh.points[whole.mesh.cells[np.argmax(cells)]].mean(axis=0)
    return f"near ({', '.join(f'{value:.6g}' for value in centre)}) m"
