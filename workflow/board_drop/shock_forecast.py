"""Scheme, levels, time steps and cost of a shock, from the parameters of its case alone."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from reflowshock.problem import Problem
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
    from reflowshock.fem.estimates.estimate import WindowPlan
    from reflowshock.workflow.package.case import BoardDropCase

# Measured on jedec_bga, bga_drop and hu_bga_drop: until ranks have loaded libraries and kernels; set-up and a sample of
# histories, of any mesh and an element.
SECONDS_TO_START, SETUP_SECONDS, SAMPLE_SECONDS = 5.0, 5e-5, 2e-7
SECONDS_OF_SAMPLE = 5e-3
FIELD_SECONDS = 1.4e-5  # of an element in one sample of fields
MODE_SOLUTIONS = 20  # solutions by one factor for each natural mode


@dataclass(frozen=True, slots=True)
class LevelForecast:
    """Parts that take one step: their names, the step [s], steps a window, elements, cost of an update of all."""

    parts: tuple[str, ...]
    step: float
    count: int
    elements: int
    cost: float


@dataclass(frozen=True, slots=True)
class ShockForecast:
    """Scheme, time steps and wall time of the shock.

    Attributes:
        scheme: how the models of the two-scale run are coupled, and why.
        levels: elements by the steps that they take, the window first.
        window: step of the macro model [s].
        substeps: m, steps of a DNS per window.
        windows: number of windows.
        search: predicted wall time of the windows of the run that finds the critical joints [s], zero where there is
            none.
        two_scale: the same of the two-scale run.
        dns: the same of the DNS in explicit steps.
        dns_share: of the windows, those that the DNS has.
        share: of the simulated time, what is expected where the duration is ``auto``; the seconds are for all of it.
        implicit: the same in implicit steps on one rank, where everything is elastic.
        updates_per_second: element updates per second and rank that the prediction assumes.
    """

    scheme: tuple[str, str]
    levels: tuple[LevelForecast, ...]
    window: float
    substeps: int
    windows: int
    search: float
    two_scale: float
    dns: float
    dns_share: float
    share: float
    implicit: float
    updates_per_second: float

    @property
    def ratio(self) -> float:
        """Return the wall time of the two-scale run over that of a DNS of all windows."""
        return self.two_scale * self.dns_share / self.dns


def forecast_shock(case: "BoardDropCase", parts: Parts, share: float = 1.0) -> ShockForecast:
    """Predict the scheme, the time steps and the wall time of the shock.

    Args:
        case: the case.
        parts: of the mesh with all joints fine.
        share: see ``ShockForecast``.
    """
    from reflowshock.fem.estimates.estimate import UPDATES_PER_SECOND, implicit_plan, largest_implicit_step, shortened
    from reflowshock.fem.estimates.solver_cost import implicit_cost, plate_nodes

    shock = case.shock
    scheme, levels, seconds = _coupled(case, two_scale_parts(case))
    search = _coupled(case, coarse_parts(case))[2] if shock.coupling.fine_joints == "critical" else 0.0
    plan, dns = _direct(case, parts)
    direct = shortened(plan, shock.numerics.dns_duration or longest_duration(case))
    of_dns = direct.windows / plan.windows
    pulses = [shock.pulse_duration] if shock.pulse_duration else []
    slow = implicit_plan(direct, largest_implicit_step(longest_duration(case), pulses))
    elements = sum(part.elements for part in parts.values())
    implicit = implicit_cost(plate_nodes(elements), slow.windows * slow.substeps).seconds
    return ShockForecast(
        scheme=scheme,
        levels=levels,
        window=plan.window,
        substeps=plan.substeps,
        windows=plan.windows,
        search=search,
        two_scale=seconds,
        dns=of_dns * dns,
        dns_share=of_dns,
        share=share,
        implicit=implicit,
        updates_per_second=UPDATES_PER_SECOND,
    )


def seconds_around(case: "BoardDropCase", parts: Parts, share: float = 1.0) -> float:
    """Predict the wall time [s] of a run outside its windows: start, set-up, samples; ``share`` of all samples."""
    elements, numerics = sum(part.elements for part in parts.values()), case.shock.numerics
    histories, fields = share * numerics.history_samples, share * numerics.field_samples
    shared = elements / case.shock.ranks.total * (histories * SAMPLE_SECONDS + fields * FIELD_SECONDS)
    return SECONDS_TO_START + SETUP_SECONDS * elements + histories * SECONDS_OF_SAMPLE + shared


def mode_seconds(case: "BoardDropCase") -> float:
    """Predict the wall time [s] of finding the natural modes, where they are asked for."""
    from reflowshock.fem.estimates.solver_cost import implicit_cost, plate_nodes

    if not case.shock.modes:
        return 0.0
    elements = sum(part.elements for part in coarse_parts(case).values())
    return implicit_cost(plate_nodes(elements), MODE_SOLUTIONS * case.shock.modes).seconds


def implicit_seconds(case: "BoardDropCase") -> float | None:
    """Predict the wall time of the whole shock in implicit steps on one rank; None where something is not linear."""
    parts = forecast_parts(case)
    numerics = case.shock.numerics.model_copy(update={"dns_duration": None})
    whole = case.model_copy(update={"shock": case.shock.model_copy(update={"numerics": numerics})})
    return forecast_shock(whole, parts).implicit if is_linear(parts) else None


def _slow(case: "BoardDropCase", parts: Parts) -> frozenset[str]:
    """Return the parts that the window follows: the board, or all that drives."""
    driving = coarse_parts(case) if case.shock.coupling.direction == "one_way" else ()
    return frozenset(driving or (name for name in parts if is_box(name)))


def _plan(case: "BoardDropCase", parts: Parts):
    """Return the windows of a mesh."""
    from reflowshock.fem.estimates.estimate import damped_critical_step, window_plan

    shock, numerics = case.shock, case.shock.numerics
    macro = min(parts[name].critical_step for name in _slow(case, parts) & parts.keys())
    meso = min(part.scaled_step for part in parts.values())
    macro, meso = (damped_critical_step(step, shock.damping.coefficients[1]) for step in (macro, meso))
    return window_plan(macro, meso, numerics.step_fraction, longest_duration(case), numerics.history_samples)


def shorter_than_window(case: "BoardDropCase") -> Iterator[Problem]:
    """Find a pulse, or a whole shock, that ends within the first window of the two-scale run."""
    from reflowshock.fem.estimates.estimate import damped_critical_step

    shock, parts = case.shock, two_scale_parts(case)
    slowest = min(parts[name].critical_step for name in _slow(case, parts) & parts.keys())
    longest = shock.numerics.step_fraction * damped_critical_step(slowest, shock.damping.coefficients[1])
    for key, duration, window in (
        ("shock.duration", longest_duration(case), longest),
        ("shock.pulse_duration", shock.pulse_duration, min(longest, _plan(case, parts).window)),
    ):
        if duration is not None and duration < window:
            message = f"is shorter than one coupling window ({short(window)})"
            allowed = f'>= {short(window)}, a smaller shock.numerics.step_fraction, or shock.numerics.modes = ["dns"]'
            yield Problem(key, message, short(duration), allowed)


def _direct(case: "BoardDropCase", parts: Parts):
    """Return windows and seconds of the windows of a DNS."""
    from reflowshock.fem.estimates.estimate import predict_seconds

    plan, board = _plan(case, parts), parts[MACRO].in_boxes
    work = sum(part.elements * part.cost for name, part in parts.items() if name != MACRO)
    return plan, predict_seconds(board, [(work, plan.substeps)], plan, case.shock.ranks, at_once=True)[1]


def _coupled(case: "BoardDropCase", parts: Parts) -> tuple[tuple[str, str], tuple[LevelForecast, ...], float]:
    """Return scheme, levels and seconds of the windows of a two-scale run."""
    from reflowshock.fem.estimates.estimate import IDLE_COST, predict_seconds

    plan, scheme = _plan(case, parts), forecast_scheme(case, parts)
    if scheme[0] == "local_steps":
        ratios, pieces = _levels(case, parts, plan.window)
    elif scheme[0] == "held_velocity" and _takes_path_levels(case):
        ratios, pieces = _path_levels(case, parts, plan)
    else:
        macro = macro_parts(case, parts)
        ratios, pieces = (plan.substeps,), [Piece(name, parts[name].elements, int(name not in macro)) for name in parts]
    levels, count = [], 1
    for level in range(len(ratios) + 1):
        count *= ratios[level - 1] if level else 1
        here = [piece for piece in pieces if piece.level == level]
        elements = sum(piece.elements for piece in here)
        cost = sum(piece.elements * parts[piece.part].cost for piece in here)
        mainly = tuple(piece.part for piece in here if 2 * piece.elements > parts[piece.part].elements)
        levels.append(LevelForecast(mainly, plan.window / count, count, elements, cost))
    work, local = [(level.cost, level.count) for level in levels[1:]], scheme[0] == "local_steps"
    if not local:  # one motion takes all of them, and moves those that do not act, too
        idle = IDLE_COST * sum(level.elements * (count - level.count) for level in levels[1:])
        work = [((sum(cost * steps for cost, steps in work) + idle) / count, count)]
    boxes = sum(parts[name].in_boxes for name in levels[0].parts)
    seconds = predict_seconds(boxes, work, plan, case.shock.ranks, at_once=not local)[0]
    return scheme, tuple(levels), seconds


def forecast_scheme(case: "BoardDropCase", parts: Parts) -> tuple[str, str]:
    """Return the scheme of the coupling, and why; layers of board around the joints are taken to be there."""
    from reflowshock.fem.division.division import choose_scheme

    wanted = case.shock.coupling.scheme
    if case.shock.coupling.direction == "one_way":
        return "held_velocity", "shock.coupling.direction = one_way"
    if wanted != "auto":
        return wanted, f"shock.coupling.scheme = {wanted}"
    choice = choose_scheme(is_linear(parts), buffer_possible=True)
    return choice.scheme, choice.why


def macro_parts(case: "BoardDropCase", parts: Parts) -> frozenset[str]:
    """Return the parts of the macro model where each model takes one step: not the board close to the joints."""
    return _slow(case, parts) if case.shock.coupling.direction == "one_way" else frozenset({MACRO})


@dataclass(frozen=True, slots=True)
class Piece:
    """Elements of a part that take one step, and its level."""

    part: str
    elements: int
    level: int


def _levels(case: "BoardDropCase", parts: Parts, window: float) -> tuple[tuple[int, ...], list[Piece]]:
    """Return the ratios of the levels of local steps, and all parts in them, as if parts did not touch."""
    import numpy as np

    from reflowshock.fem.division.choose_levels import Pace, choose_levels
    from reflowshock.fem.errors import LevelError
    from reflowshock.fem.estimates.estimate import BOARD_ADVANTAGE
    from reflowshock.fem.mesh.tie import Tie

    steps = np.array([part.scaled_step for part in parts.values()])
    box = np.array([is_box(name) for name in parts])
    cost = np.array([part.elements * part.cost for part in parts.values()]) * np.where(box, 1.0, BOARD_ADVANTAGE)
    coupling = case.shock.coupling
    pace = Pace(steps, cost, window, case.shock.numerics.step_fraction)
    try:
        level, ratios = choose_levels(
            np.arange(len(steps), dtype=np.int32)[:, None], Tie.none(), pace, coupling.most_levels
        )
    except LevelError as error:
        raise CaseError(
            "plan", [Problem("shock.coupling.levels", str(error), coupling.levels, "auto, or more")]
        ) from error
    return ratios, [Piece(name, parts[name].elements, own) for name, own in zip(parts, level.tolist(), strict=True)]


def _takes_path_levels(case: "BoardDropCase") -> bool:
    """Whether nothing but elements and body accelerations acts on the joints' side; a large mass is on the board."""
    springs = any(support.bedding for support in case.supports.values())
    return not (
        case.shock.coupling.direction == "one_way" or springs or any(case.shock.damping.coefficients) or case.cooled
    )


def _path_levels(case: "BoardDropCase", parts: Parts, plan: "WindowPlan") -> tuple[tuple[int, ...], list[Piece]]:
    """Return the ratios of the levels along a path, and the parts in them as ``fem.division.path_levels`` chooses them.

    Copper is next to solder, whose layers at the pads are pieces of their own; other parts do not touch here.
    """
    import numpy as np

    from reflowshock.fem.division.choose_levels import Pace
    from reflowshock.fem.division.division import Division
    from reflowshock.fem.division.path_levels import with_path_levels
    from reflowshock.fem.estimates.estimate import BOARD_ADVANTAGE

    chain = _from_copper_on(case, parts)
    others = [(name, part.elements) for name, part in parts.items() if name not in dict(chain)]
    names, sizes = zip(*chain, *others, strict=True)
    near = np.eye(len(names), dtype=bool)
    for first in range(len(chain) - 1):
        near[first, first + 1] = near[first + 1, first] = True
    meso = ~np.isin(names, list(macro_parts(case, parts)))
    steps = np.array([parts[name].scaled_step for name in names])
    cost = np.array([BOARD_ADVANTAGE * parts[name].cost * size for name, size in zip(names, sizes, strict=True)])
    division = with_path_levels(
        Division("held_velocity", ~meso, meso, meso.astype(np.int32), (plan.substeps,), plan),
        Pace(steps, cost, plan.window, case.shock.numerics.step_fraction),
        lambda taken: meso & (near & taken).any(axis=1),
        case.shock.coupling.most_levels,
    )
    return division.ratios, [Piece(*own) for own in zip(names, sizes, division.level.tolist(), strict=True)]


def _from_copper_on(case: "BoardDropCase", parts: Parts) -> list[tuple[str, int]]:
    """Return the elements of copper, of the first and second layers of solder on it, and of all other solder."""
    if "copper" not in parts or "solder" not in parts:
        return []
    solder = parts["solder"].elements
    layer = min(2 * solder // case.package.joint_numerics.layers, solder // 2)  # of all fine joints, at both pads
    rest = solder - 2 * layer
    return [("copper", parts["copper"].elements), ("solder", layer), ("solder", layer), ("solder", rest)]
