"""What a run would do, and what it would cost. Nothing is run, nothing is written."""

from collections.abc import Mapping

from rich.console import Console
from rich.table import Table

from reflowshock.workflow.case.case import FULL, Case
from reflowshock.workflow.case.fields import display, leaves
from reflowshock.workflow.case.text import duration
from reflowshock.workflow.effects.page import effects_table
from reflowshock.workflow.kinds import kind_of, stage_seconds
from reflowshock.workflow.process.terminal import new_table, styled
from reflowshock.workflow.store.keys import Change
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.state import StageState, examine, why_stale
from reflowshock.workflow.store.store import Store

LONGEST_LIST = 4


def show_plan(store: Store, point: Point, console: Console) -> None:
    """Print stages to run and why, effects, sizes, time steps, predicted cost and rank placement."""
    case = point.case
    kind, scale = kind_of(case), "" if case.scale == FULL else f", scale {case.scale}"
    outlook = kind.forecast(case)
    console.print(styled("[bold]{}{}[/]  {}\n", case.case.name, scale, case.case.title))
    console.print(_stages(store, point, predicted_costs(case, outlook.seconds)))
    console.print(effects_table(case, outlook.effects, kind.acts))
    for shown in kind.plan(case, outlook):
        console.print(shown)


def change_text(change: Change, case: Case) -> str:
    """Say what a parameter changed from and to, in the user's unit."""
    fields = {key: field for key, _, field in leaves(case)}

    def text(value: object) -> str:
        if value is None:
            return "nothing"
        if change.key not in fields:
            return str(value)
        return display(tuple(value) if isinstance(value, list) else value, fields[change.key])

    return f"{change.key}: {text(change.old)} -> {text(change.new)}"


def reason(state: StageState, case: Case) -> str:
    """Say why a stage will run or not."""
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
    """Predict the wall time [s] of all that has to be made up to a stage, corrected by what accuracy measured here."""
    from reflowshock.workflow.convergence.calibration import calibration_of

    known, seconds = calibration_of(point.case), stage_seconds(point.case)
    states = examine(store, point)
    stages = [stage.name for stage in point.case.pipeline.upstream(until) if states[stage.name].stale]
    own = [(name, seconds[name]) for name in stages if name in seconds]
    return sum(known.seconds(name, predicted) if known is not None else predicted for name, predicted in own)


def predicted_costs(case: Case, seconds: Mapping[str, float]) -> dict[str, str]:
    """Write the predicted wall time of stages; corrected by what the command accuracy measured here."""
    from reflowshock.workflow.convergence.calibration import calibration_of

    known, texts = calibration_of(case), {}
    for stage, predicted in seconds.items():
        measured = known is not None and known.knows(stage)
        cost = known.seconds(stage, predicted) if known is not None else predicted
        source = f" (measured: accuracy, {known.points} points)" if known is not None and measured else ""
        texts[stage] = f"about {duration(cost)}{source}"
    return texts


def _stages(store: Store, point: Point, costs: Mapping[str, str]) -> Table:
    table = new_table(f"Stages, in {store.folder}", "stage", "", "cost", "why")
    for name, state in examine(store, point).items():
        mark = styled("[yellow]run[/]" if state.stale else "[green]skip[/]")
        cost = costs.get(name, "") if state.stale else ""
        table.add_row(name, mark, cost, reason(state, point.case))
    return table
