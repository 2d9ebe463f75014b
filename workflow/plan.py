"""Plan of a run: stages to run, reasons and predicted cost, without running or writing anything."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

from reflowshock.workflow.case.case import FULL, Case
from reflowshock.workflow.case.fields import display, leaves
from reflowshock.workflow.case.stage import ERRORS, SHOCK
from reflowshock.workflow.case.text import duration
from reflowshock.workflow.effects.page import effects_table
from reflowshock.workflow.kinds import every_stage, kind_of, stage_seconds
from reflowshock.workflow.pipeline.companions import at_once, companion_seconds
from reflowshock.workflow.pipeline.gate import LONG
from reflowshock.workflow.process.kernel_folder import compilation_time
from reflowshock.workflow.process.machine_speed import UNMEASURED, machine_speed
from reflowshock.workflow.process.terminal import new_table, style_text
from reflowshock.workflow.store.companions import companion_title
from reflowshock.workflow.store.keys import Change
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.state import StageState, examine, why_stale
from reflowshock.workflow.store.store import Store

LONGEST_LIST = 4
FORMER = "*"  # marks a cost corrected by former runs in the folder


@dataclass(frozen=True, slots=True)
class PlannedStage:
    """Planned action of a stage: whether it runs, reason, and predicted wall time [s] (None if unknown)."""

    runs: bool
    why: str
    seconds: float | None


def planned_stages(store: Store, point: Point) -> dict[str, PlannedStage]:
    """Return the planned action of each stage of a run, in order; nothing is changed.

    Args:
        store: Store of the run folder, whose files are examined.
        point: Case with its settings, which determines the run.

    Returns:
        Name of a stage -> whether it runs, why, and its predicted time [s].
    """
    costs = predicted_costs(store, point.case, stage_seconds(point.case))
    return {
        name: PlannedStage(state.stale, reason(state, point.case), costs[name].seconds)
        for name, state in examine(store, point).items()
    }


def plan_record(store: Store, point: Point) -> dict[str, Any]:
    """Return a plan as JSON data: stages, effects as in ``summary.json``, and wall times [s].

    Args:
        store: Store of the run folder, whose files are examined.
        point: Case of the run with its settings.

    Returns:
        ``case`` (name), ``folder``, ``stages`` (``runs``, ``why``, ``seconds`` by name), ``effects``, ``companions``
        of a drop, ``compilation`` [s] and ``seconds`` of all.
    """
    stages = planned_stages(store, point)
    once = compilation_time([name for name, stage in stages.items() if stage.runs])
    companions = _companions(store, point, [name for name, stage in stages.items() if stage.runs])
    once_and_companions = once + at_once(companions.values())
    return {
        "case": point.case.case.name,
        "folder": str(store.folder),
        "stages": {name: asdict(stage) for name, stage in stages.items()},
        "companions": companions,
        "effects": dict(kind_of(point.case).forecast(point.case).effects),
        "compilation": once,
        "seconds": once_and_companions + sum(stage.seconds or 0.0 for stage in stages.values() if stage.runs),
    }


def show_plan(store: Store, point: Point, console: Console) -> None:
    """Print stages to run and why, effects, sizes, time steps, predicted cost and rank placement.

    Args:
        store: Store of the run folder, whose files are examined; nothing is changed.
        point: Case of the run with its settings.
        console: Console to print to.
    """
    case = point.case
    kind, scale = kind_of(case), "" if case.scale == FULL else f", scale {case.scale}"
    outlook = kind.forecast(case)
    console.print(style_text("[bold]{}{}[/]  {}\n", case.case.name, scale, case.case.title))
    console.print(_stages(store, point, every_stage(case, outlook.seconds)))
    console.print(effects_table(case, outlook.effects, kind.acts))
    for table in kind.plan(case, outlook):
        console.print(table)
    if SHOCK in case.pipeline.names:
        speed = machine_speed()
        console.print(style_text("[dim]{}", UNMEASURED if speed is None else speed.in_words()))


def change_text(change: Change, case: Case) -> str:
    """Return a changed parameter as text in the user's unit: "key: old -> new".

    Args:
        change: Key, old and new SI value.
        case: Case, whose fields give the units.
    """
    fields = {key: field for key, _, field in leaves(case)}

    def text(value: object) -> str:
        if value is None:
            return "nothing"
        if change.key not in fields:
            return str(value)
        return display(tuple(value) if isinstance(value, list) else value, fields[change.key])

    return f"{change.key}: {text(change.old)} -> {text(change.new)}"


def reason(state: StageState, case: Case) -> str:
    """Return the reason why a stage will run or not, one line per changed parameter.

    Args:
        state: State of the stage's product.
        case: Case of the run, whose fields give the units.
    """
    if not state.stale:
        redone = ", ".join(state.because_of)
        return f"up to date if {redone} gives the same result" if redone else "up to date"
    if state.missing:
        return "no product yet"
    if state.damaged:
        return why_stale(state)
    changes = [change_text(change, case) for change in state.changes]
    if len(changes) > LONGEST_LIST:
        changes = [*changes[:LONGEST_LIST], f"and {len(changes) - LONGEST_LIST} more"]
    if state.because_of:
        changes.append("follows " + ", ".join(state.because_of))
    return "\n".join(changes) or "no product yet"


def predicted_seconds(store: Store, point: Point, until: str) -> float:
    """Predict the wall time of all missing products up to a stage [s].

    Args:
        store: Store of the run folder, whose files are examined.
        point: Case of the run with its settings.
        until: Last stage to run.
    """
    states, costs = examine(store, point), predicted_costs(store, point.case, stage_seconds(point.case))
    stale = [stage.name for stage in point.case.pipeline.upstream(until) if states[stage.name].stale]
    companions = at_once(_companions(store, point, stale).values())
    return sum(costs[name].seconds for name in stale) + companions + compilation_time(stale)


def _companions(store: Store, point: Point, stale: Sequence[str]) -> dict[str, float]:
    """Predict the wall time of each companion that runs [s], if the stage that reads them is among stale stages."""
    return companion_seconds(store, point) if ERRORS.name in stale else {}


@dataclass(frozen=True, slots=True)
class PredictedCost:
    """Predicted wall time of a stage [s], and the source of its correction (empty without correction)."""

    seconds: float
    source: str = ""

    def __str__(self) -> str:
        return f"about {duration(self.seconds)}{self.source}"


def predicted_costs(store: Store, case: Case, seconds: Mapping[str, float]) -> dict[str, PredictedCost]:
    """Correct the predicted wall times of stages by a convergence study of the case, otherwise by earlier runs.

    Args:
        store: Store with the records of earlier runs.
        case: Case of the run.
        seconds: Stage -> predicted wall time [s].

    Returns:
        Stage -> corrected wall time [s], and a text on the source of the correction, empty without one.
    """
    from reflowshock.workflow.convergence.calibration import Calibration, calibration_from_store, calibration_from_study

    study, former = calibration_from_study(case) or Calibration({}, 0), calibration_from_store(store, seconds)
    costs = {}
    for stage, forecast in seconds.items():
        calibration, source = former, FORMER
        if study.covers(stage):
            calibration, source = study, f" (measured: accuracy, {study.points} points)"
        seconds_corrected = calibration.corrected(stage, forecast)
        costs[stage] = PredictedCost(seconds_corrected, source if calibration.covers(stage) else "")
    return costs


def _stages(store: Store, point: Point, seconds: Mapping[str, float]) -> Table:
    table = new_table(f"Stages, in {store.folder}", "stage", "", "cost", "why")
    states, costs = examine(store, point), predicted_costs(store, point.case, seconds)
    companions = _companions(store, point, [name for name, state in states.items() if state.stale])
    for name, state in states.items():
        if name == ERRORS.name and companions:
            titles = "; ".join(companion_title(name) for name in companions)
            cost = f"about {duration(at_once(companions.values()))}"
            table.add_row("companions", style_text("[yellow]run[/]"), cost, f"{titles}, at once")
        mark = style_text("[yellow]run[/]" if state.stale else "[green]skip[/]")
        table.add_row(name, mark, str(costs[name]) if state.stale else "", reason(state, point.case))
    if once := compilation_time([name for name, state in states.items() if state.stale]):
        table.add_row("kernels", "", f"about {duration(once)}", "compiled once, in these stages")
    stale = [costs[name] for name, state in states.items() if state.stale]
    left = sum(cost.seconds for cost in stale) + at_once(companions.values()) + once
    remark = _about_time(left)
    if any(cost.source == FORMER for cost in stale):
        remark += f"; {FORMER}: corrected by former runs here"
    table.add_row("all", "", f"about {duration(left)}" if left else "nothing to do", remark, style="bold")
    return table


def _about_time(seconds: float) -> str:
    """Return a remark on the predicted wall time [s]: whether confirmation is needed."""
    return "more than an hour: run asks first; scripts need --yes" if seconds > LONG else "on an otherwise idle machine"
