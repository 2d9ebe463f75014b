"""Scheme, levels, time steps and cost of a shock, from the parameters of its case alone."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from reflowshock.fem.materials.parameters import Material
from reflowshock.problem import Problem
from reflowshock.workflow.board_drop.duration import longest_duration
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.text import short

if TYPE_CHECKING:
    from reflowshock.meshing.board.estimate import PartEstimate
    from reflowshock.workflow.package.case import BoardDropCase

MACRO = "board"  # role of the parts whose elements the window follows
BOXES = ("board", "substrate", "die")  # roles whose elements are boxes, but for columns
IN_COLUMN = "column"  # what ``shock.numerics.mass_scaled`` calls them
# Measured on jedec_bga: until ranks have loaded libraries and kernels; set-up and a sample of histories, an element.
SECONDS_TO_START, SETUP_SECONDS, SAMPLE_SECONDS = 4.0, 1.5e-4, 2.5e-6
COLUMN = f"_{IN_COLUMN}"  # ends the names of parts of board and substrate around fine joints


@dataclass(frozen=True, slots=True)
class PartForecast:
    """A part of the mesh.

    Attributes:
        elements: its hexahedra.
        critical_step: of the smallest one [s].
        scaled_step: the same with its mass scaled to the step of the others [s].
        cost: of an update over that of an assembled elastic element.
        linear: whether its force is linear in the displacement.
    """

    elements: int
    critical_step: float
    scaled_step: float
    cost: float
    linear: bool


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


Parts = Mapping[str, PartForecast]


def forecast_parts(case: "BoardDropCase") -> dict[str, PartForecast]:
    """Predict size and critical time step of every part of the mesh with all joints fine."""
    from reflowshock.meshing.board.estimate import count_elements

    return _forecasts(case, count_elements(case.package, case.board, case.warpage))


def two_scale_parts(case: "BoardDropCase") -> dict[str, PartForecast]:
    """Predict the same of a two-scale run, in which joints may be coarse; of a one-way run those of both models."""
    from reflowshock.meshing.board.estimate import count_elements

    if case.shock.coupling.direction == "one_way":
        return _driven_parts(case) | coarse_parts(case)
    return _forecasts(case, count_elements(case.package, case.board, case.warpage, fine_joint_count(case)))


def coarse_parts(case: "BoardDropCase") -> dict[str, PartForecast]:
    """Predict the same of the run that finds the critical joints."""
    from reflowshock.meshing.board.estimate import count_elements

    return _forecasts(case, count_elements(case.package, case.board, case.warpage, 0))


def _driven_parts(case: "BoardDropCase") -> dict[str, PartForecast]:
    """Predict the same of the fine joints of a one-way run; the board around them is left out."""
    from reflowshock.meshing.board.estimate import count_elements

    estimates = count_elements(case.package, case.board, case.warpage, fine_joint_count(case))
    return _forecasts(
        case, {name: part for name, part in estimates.items() if name in ("solder", "copper") or name.endswith(COLUMN)}
    )


def fine_joint_count(case: "BoardDropCase") -> int | None:
    """Return how many joints of a two-scale run are fine, None if all."""
    coupling = case.shock.coupling
    if coupling.fine_joints == "all":
        return None
    return coupling.critical_joints if coupling.fine_joints == "critical" else len(set(coupling.fine_joints))


def _forecasts(case: "BoardDropCase", estimates: "Mapping[str, PartEstimate]") -> dict[str, PartForecast]:
    import numpy as np

    from reflowshock.fem.estimates.estimate import box_critical_step

    scaled = case.shock.numerics.mass_scaled
    step = {name: box_critical_step(material_of(case, name), np.array(of.smallest)) for name, of in estimates.items()}
    heavier = {name for name in step if role_of(name) in scaled or (name.endswith(COLUMN) and IN_COLUMN in scaled)}
    others = min((step[name] for name in step if name not in heavier), default=min(step.values()))
    target = min(others, case.shock.numerics.mass_scaled_step or math.inf)
    raised = step | {name: max(step[name], target) for name in heavier}
    return {
        name: PartForecast(
            part.elements, step[name], raised[name], relative_cost(case, name), is_linear_part(case, name)
        )
        for name, part in estimates.items()
    }


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
    elements = sum(part.elements for part in parts.values()) / case.shock.ranks.total
    samples = share * case.shock.numerics.history_samples
    return SECONDS_TO_START + elements * (SETUP_SECONDS + samples * SAMPLE_SECONDS)


def implicit_seconds(case: "BoardDropCase") -> float | None:
    """Predict the wall time of the whole shock in implicit steps on one rank; None where something is not linear."""
    parts = forecast_parts(case)
    numerics = case.shock.numerics.model_copy(update={"dns_duration": None})
    whole = case.model_copy(update={"shock": case.shock.model_copy(update={"numerics": numerics})})
    return forecast_shock(whole, parts).implicit if is_linear(parts) else None


def is_linear(parts: Parts) -> bool:
    """Whether the forces of all elements are linear."""
    return all(part.linear for part in parts.values())


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

    plan, board = _plan(case, parts), _in_boxes(MACRO, parts[MACRO])
    work = sum(part.elements * part.cost for name, part in parts.items() if name != MACRO)
    return plan, predict_seconds(board, [(work, plan.substeps)], plan, case.shock.ranks, at_once=True)[1]


def _in_boxes(name: str, part: PartForecast) -> float:
    """Return the cost of an update of a part's elements in that of linear boxes of a board."""
    from reflowshock.fem.estimates.estimate import BOARD_ADVANTAGE

    return part.elements * (1.0 if is_box(name) and part.linear else BOARD_ADVANTAGE * part.cost)


def _coupled(case: "BoardDropCase", parts: Parts) -> tuple[tuple[str, str], tuple[LevelForecast, ...], float]:
    """Return scheme, levels and seconds of the windows of a two-scale run."""
    from reflowshock.fem.estimates.estimate import predict_seconds

    plan, scheme = _plan(case, parts), forecast_scheme(case, parts)
    if scheme[0] == "local_steps":
        ratios, level_of = _levels(case, parts, plan.window)
    else:
        ratios, level_of = (plan.substeps,), {name: int(name not in macro_parts(case, parts)) for name in parts}
    levels, count = [], 1
    for level in range(len(ratios) + 1):
        count *= ratios[level - 1] if level else 1
        here = {name: parts[name] for name in parts if level_of[name] == level}
        elements = sum(part.elements for part in here.values())
        cost = sum(part.elements * part.cost for part in here.values())
        levels.append(LevelForecast(tuple(here), plan.window / count, count, elements, cost))
    work = [(level.cost, level.count) for level in levels[1:]]
    boxes = sum(_in_boxes(name, parts[name]) for name in levels[0].parts)
    seconds = predict_seconds(boxes, work, plan, case.shock.ranks, at_once=scheme[0] != "local_steps")[0]
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


def _levels(case: "BoardDropCase", parts: Parts, window: float) -> tuple[tuple[int, ...], dict[str, int]]:
    """Return the ratios of step levels and the level of each part, as if parts did not touch."""
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
    return ratios, dict(zip(parts, level.tolist(), strict=True))


def relative_cost(case: "BoardDropCase", part: str) -> float:
    """Return the cost of an element of a part over that of a linear one."""
    from reflowshock.fem.estimates.estimate import UPDATES_PER_SECOND
    from reflowshock.fem.estimates.solver_cost import NONLINEAR_RATE, TURNING_BOX_RATE, TURNING_RATE

    numerics = case.shock.numerics
    if is_linear_part(case, part):
        return 1.0
    if material_of(case, part).plasticity is None and numerics.kinematics == "corotational":
        box = role_of(part) in BOXES and not part.endswith(COLUMN)
        return UPDATES_PER_SECOND / (TURNING_BOX_RATE if box else TURNING_RATE)
    return UPDATES_PER_SECOND / NONLINEAR_RATE[numerics.formulation]


def is_linear_part(case: "BoardDropCase", part: str) -> bool:
    """Whether elements of a part neither yield nor turn."""
    return case.shock.numerics.kinematics == "small" and material_of(case, part).plasticity is None


def role_of(part: str) -> str:
    """Return the material role of a part: its name up to "@", then up to "_"."""
    return part.split("@")[0].split("_")[0]


def is_box(part: str) -> bool:
    """Whether a part is of the board's boxes: a column in their place has smaller elements."""
    return role_of(part) == MACRO and not part.endswith(COLUMN)


def material_of(case: "BoardDropCase", part: str) -> Material:
    """Return the material of a part."""
    return getattr(case.materials, role_of(part))
