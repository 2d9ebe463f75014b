"""Forecast of a shock: coupling scheme, step levels, time steps and wall time, from the case alone.

``part_forecast`` estimates the parts of the mesh; ``fem.division.decide``, which also divides the mesh of the run,
chooses scheme, windows and levels; ``fem.estimates`` predicts the wall time of the fastest rank placement.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from reflowshock.problem import Problem
from reflowshock.workflow.board_drop.board_deflection import decided
from reflowshock.workflow.board_drop.coarser_case import needs_search, search_case
from reflowshock.workflow.board_drop.duration import longest_duration
from reflowshock.workflow.board_drop.part_forecast import (
    MACRO,
    Parts,
    coarse_parts,
    forecast_parts,
    is_box,
    is_linear,
    two_scale_parts,
)
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.text import short

if TYPE_CHECKING:
    from reflowshock.fem.division.decide import MeshEstimate
    from reflowshock.fem.division.division import Division, Rules
    from reflowshock.fem.estimates.estimate import WindowPlan
    from reflowshock.workflow.package.case import BoardDropCase

# Measured on jedec_bga, bga_drop and hu_bga_drop.
SECONDS_TO_START = 5.0  # until all ranks have loaded libraries and kernels
SETUP_SECONDS = 5e-5  # set-up, for each element
SECONDS_OF_SAMPLE, SAMPLE_SECONDS = 5e-3, 2e-7  # one sample of the histories, and for each element
FIELD_SECONDS = 1.4e-5  # one sample of the fields, for each element
MODE_SOLUTIONS = 20  # solutions with one factorisation for each natural mode


@dataclass(frozen=True, slots=True)
class LevelForecast:
    """A step level of the two-scale run.

    Attributes:
        parts: Parts with more than half of their elements in the level.
        step: Time step [s].
        count: Steps in a window.
        elements: Number of elements.
        cost: Cost of an update of all of them, in updates of an assembled elastic element.
    """

    parts: tuple[str, ...]
    step: float
    count: int
    elements: int
    cost: float


@dataclass(frozen=True, slots=True)
class TwoScaleForecast:
    """Scheme, step levels and wall time of a two-scale run.

    Attributes:
        scheme: Coupling scheme of the two models.
        reason: Reason for the scheme.
        levels: Step levels, the window first.
        seconds: Predicted wall time of all windows [s].
    """

    scheme: str
    reason: str
    levels: tuple[LevelForecast, ...]
    seconds: float


@dataclass(frozen=True, slots=True)
class ShockForecast:
    """Scheme, time steps and wall time of a shock.

    Attributes:
        scheme: Coupling scheme of the two-scale run.
        reason: Reason for the scheme.
        levels: Step levels of the two-scale run, the window first.
        window: Step of the macro model [s].
        substeps: Steps of a DNS in a window, m.
        windows: Number of windows.
        two_scale: Predicted wall time of the windows of the two-scale run [s].
        dns: Predicted wall time of the windows of the DNS with explicit steps [s].
        dns_share: Share of the windows that the DNS computes.
        share: Share of the longest duration that is expected where the duration is ``auto``; the wall times are for
            the longest duration.
        implicit: Predicted wall time of the DNS with implicit steps on one rank [s], for elastic materials only.
        updates_per_second: Element updates per second and rank that the prediction assumes.
    """

    scheme: str
    reason: str
    levels: tuple[LevelForecast, ...]
    window: float
    substeps: int
    windows: int
    two_scale: float
    dns: float
    dns_share: float
    share: float
    implicit: float
    updates_per_second: float

    @property
    def ratio(self) -> float:
        """Ratio of the wall times of the two-scale run and a DNS of the same duration."""
        return self.two_scale * self.dns_share / self.dns


def forecast_shock(case: "BoardDropCase", parts: Parts, share: float = 1.0) -> ShockForecast:
    """Predict the scheme, the time steps and the wall time of a shock.

    Args:
        case: Case of a board drop.
        parts: Forecast of each part of the mesh by name, with all joints fine.
        share: Expected duration of the run over its longest duration, 0 to 1.

    Returns:
        Coupling scheme with its reason, step levels, and wall times [s] of the two-scale run and of the DNS (one model
        with all joints fine).

    Raises:
        CaseError: The critical steps differ by more than ``shock.coupling.levels`` levels allow.
    """
    from reflowshock.fem.estimates.estimate import (
        UPDATES_PER_SECOND,
        implicit_plan,
        largest_implicit_step,
        shorten_plan,
    )
    from reflowshock.fem.estimates.solver_cost import implicit_cost, plate_nodes

    shock = case.shock
    two_scale = _forecast_two_scale(case, two_scale_parts(case))
    plan = _plan(case, parts)
    dns_plan = shorten_plan(plan, shock.numerics.dns_duration or longest_duration(case))
    dns_share = dns_plan.windows / plan.windows
    pulses = [shock.pulse_duration] if shock.pulse_duration else []
    implicit = implicit_plan(dns_plan, largest_implicit_step(longest_duration(case), pulses))
    elements = sum(part.elements for part in parts.values())
    return ShockForecast(
        scheme=two_scale.scheme,
        reason=two_scale.reason,
        levels=two_scale.levels,
        window=plan.window,
        substeps=plan.substeps,
        windows=plan.windows,
        two_scale=two_scale.seconds,
        dns=dns_share * _dns_seconds(case, parts, plan),
        dns_share=dns_share,
        share=share,
        implicit=implicit_cost(plate_nodes(elements), implicit.windows * implicit.substeps).seconds,
        updates_per_second=UPDATES_PER_SECOND,
    )


def seconds_outside_windows(case: "BoardDropCase", parts: Parts, share: float = 1.0) -> float:
    """Predict the wall time of start, set-up and output of a run [s], all that is not spent in time steps.

    Args:
        case: Case of a board drop.
        parts: Forecast of each part of the mesh by name.
        share: Share of all output samples that the run writes, 0 to 1.
    """
    elements, numerics = sum(part.elements for part in parts.values()), case.shock.numerics
    histories, fields = share * numerics.history_samples, share * numerics.field_samples
    shared = elements / case.shock.ranks.most * (histories * SAMPLE_SECONDS + fields * FIELD_SECONDS)
    return SECONDS_TO_START + SETUP_SECONDS * elements + histories * SECONDS_OF_SAMPLE + shared


def search_seconds(case: "BoardDropCase", share: float) -> float:
    """Predict the wall time [s] of the search for critical joints and the end; zero for a case without search.

    Args:
        case: Case of a board drop, as read.
        share: Expected duration of the search over its longest duration, 0 to 1.
    """
    if not needs_search(case):
        return 0.0
    coarse = search_case(decided(case))
    parts = coarse_parts(coarse)
    return share * _forecast_two_scale(coarse, parts).seconds + seconds_outside_windows(coarse, parts, share)


def mode_seconds(case: "BoardDropCase") -> float:
    """Predict the wall time [s] of computing the natural modes; zero where the case asks for none."""
    from reflowshock.fem.estimates.solver_cost import implicit_cost, plate_nodes

    if not case.shock.modes:
        return 0.0
    elements = sum(part.elements for part in coarse_parts(case).values())
    return implicit_cost(plate_nodes(elements), MODE_SOLUTIONS * case.shock.modes).seconds


def implicit_seconds(case: "BoardDropCase") -> float | None:
    """Predict the wall time [s] of the whole shock with implicit steps on one rank; None for a nonlinear model."""
    parts = forecast_parts(case)
    numerics = case.shock.numerics.model_copy(update={"dns_duration": None})
    whole = case.model_copy(update={"shock": case.shock.model_copy(update={"numerics": numerics})})
    return forecast_shock(whole, parts).implicit if is_linear(parts) else None


def shorter_than_window(case: "BoardDropCase") -> Iterator[Problem]:
    """Yield the problem of a pulse, or a whole shock, that ends within the first window of the two-scale run.

    A window is the time between two exchanges of the macro model (board) and the meso model (joints).

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    from reflowshock.fem.division.decide import longest_window

    parts = two_scale_parts(case)
    estimate = estimate_mesh(case, parts)
    longest = longest_window(estimate, _rules(case, estimate))
    for key, duration, window in (
        ("shock.duration", longest_duration(case), longest),
        ("shock.pulse_duration", case.shock.pulse_duration, min(longest, _plan(case, parts).window)),
    ):
        if duration is not None and duration < window:
            message = f"is shorter than one coupling window ({short(window)})"
            allowed = f'>= {short(window)}, a smaller shock.numerics.step_fraction, or shock.numerics.modes = ["dns"]'
            yield Problem(key, message, short(duration), allowed)


def estimate_mesh(case: "BoardDropCase", parts: Parts) -> "MeshEstimate":
    """Return the estimated mesh from which step levels and models are decided, one row per part or layer of a part.

    Args:
        case: Case of a board drop.
        parts: Number of elements and critical time step of each part of the mesh by name.
    """
    import numpy as np

    from reflowshock.fem.division.decide import MeshEstimate
    from reflowshock.fem.estimates.estimate import BOARD_ADVANTAGE

    layers = _pad_layers(case, parts)
    rows = [*layers, *((name, part.elements) for name, part in parts.items() if name not in dict(layers))]
    names, elements = [name for name, _ in rows], np.array([count for _, count in rows])
    touching = np.eye(len(rows), dtype=bool)
    for row in range(len(layers) - 1):
        touching[row, row + 1] = touching[row + 1, row] = True
    shares_matrices = np.array([is_linear(parts) and is_box(name) for name in names])
    return MeshEstimate(
        names=names,
        elements=elements,
        steps=np.array([parts[name].scaled_step for name in names]),
        cost=elements
        * np.array([parts[name].cost for name in names])
        * np.where(shares_matrices, 1.0, BOARD_ADVANTAGE),
        linear=is_linear(parts),
        macro=np.isin(names, [MACRO]),
        touching=touching,
    )


def _pad_layers(case: "BoardDropCase", parts: Parts) -> list[tuple[str, int]]:
    """Return copper, the two layers of solder next to it, and the other solder, each with its number of elements."""
    if "copper" not in parts or "solder" not in parts:
        return []
    solder = parts["solder"].elements
    layer = min(2 * solder // case.package.joint_numerics.layers, solder // 2)  # of all fine joints, at both pads
    return [("copper", parts["copper"].elements), ("solder", layer), ("solder", layer), ("solder", solder - 2 * layer)]


def _rules(case: "BoardDropCase", estimate: "MeshEstimate") -> "Rules":
    """Return the rules of the division of an estimated mesh."""
    from dataclasses import replace

    import numpy as np

    from reflowshock.fem.division.division import Rules

    rules = Rules.of_shock(
        case.shock,
        np.array([is_box(name) for name in estimate.names]),
        longest_duration(case),
        sprung=any(support.bedding for support in case.supports.values()),
        cooled=case.cooled,
    )
    if case.shock.coupling.direction == "two_way":
        return rules
    copy = np.isin(estimate.names, list(coarse_parts(case)))
    return replace(rules, copied=~copy, copy=copy)


def _plan(case: "BoardDropCase", parts: Parts) -> "WindowPlan":
    """Return the windows of a mesh with these parts."""
    from reflowshock.fem.division.decide import plan_estimate

    estimate = estimate_mesh(case, parts)
    return plan_estimate(estimate, _rules(case, estimate))


def _dns_seconds(case: "BoardDropCase", parts: Parts, plan: "WindowPlan") -> float:
    """Return the predicted wall time [s] of all windows of a DNS."""
    from reflowshock.fem.estimates.estimate import predict_seconds

    work = sum(part.elements * part.cost for name, part in parts.items() if name != MACRO)
    return predict_seconds(parts[MACRO].in_boxes, [(work, plan.substeps)], plan, case.shock.ranks, at_once=True)[1]


def _forecast_two_scale(case: "BoardDropCase", parts: Parts) -> TwoScaleForecast:
    """Return the forecast of a two-scale run with these parts."""
    from reflowshock.fem.division.decide import divide_estimate
    from reflowshock.fem.errors import LevelError
    from reflowshock.fem.estimates.estimate import IDLE_COST, predict_seconds

    estimate, coupling = estimate_mesh(case, parts), case.shock.coupling
    try:
        division = divide_estimate(estimate, _rules(case, estimate))
    except LevelError as error:
        problem = Problem("shock.coupling.levels", str(error), coupling.levels, "auto, or more")
        raise CaseError("plan", [problem]) from error
    levels = _levels(estimate, division, parts)
    work = [(level.cost, level.count) for level in levels[1:]]
    if not division.local:  # one motion takes the steps of all levels and moves the nodes of those at rest, too
        count = levels[-1].count
        idle = IDLE_COST * sum(level.elements * (count - level.count) for level in levels[1:])
        work = [((sum(cost * steps for cost, steps in work) + idle) / count, count)]
    boxes = sum(parts[name].in_boxes for name in levels[0].parts)
    seconds = predict_seconds(boxes, work, division.plan, case.shock.ranks, at_once=not division.local)[0]
    return TwoScaleForecast(division.scheme, division.why, levels, seconds)


def _levels(estimate: "MeshEstimate", division: "Division", parts: Parts) -> tuple[LevelForecast, ...]:
    """Return the step levels of a division."""
    levels = []
    for level, count in enumerate(division.counts.tolist()):
        sizes = dict.fromkeys(parts, 0)
        for row in (division.level == level).nonzero()[0].tolist():
            sizes[estimate.names[row]] += int(estimate.elements[row])
        levels.append(
            LevelForecast(
                parts=tuple(name for name, size in sizes.items() if 2 * size > parts[name].elements),
                step=division.plan.window / count,
                count=count,
                elements=sum(sizes.values()),
                cost=sum(size * parts[name].cost for name, size in sizes.items()),
            )
        )
    return tuple(levels)
