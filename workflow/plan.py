"""What a run would do, and what it would cost. Nothing is run, nothing is written."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from workflow.case import Case
from workflow.fields import display, leaves, unit_of
from workflow.forecast import Forecast, forecast
from workflow.inputs import Change, Verdict, examine
from workflow.units import from_si, in_unit

LONGEST_LIST = 4


def show_plan(case: Case, run_folder: Path, console: Console) -> None:
    """Print stages to run and why, effects, sizes, time steps, predicted cost and rank placement."""
    outlook = forecast(case)
    console.print(f"[bold]{case.case.name}[/]  {case.case.title}\n")
    console.print(_stages(case, run_folder, outlook))
    console.print(_effects(outlook))
    console.print(_sizes(outlook))
    console.print(_shock(case, outlook))
    console.print(f"[dim]{outlook.source}[/]", soft_wrap=False)


def change_text(change: Change, case: Case) -> str:
    """Say what a parameter changed from and to, in the user's unit."""
    fields = {key: field for key, _, field in leaves(case)}
    unit = unit_of(fields[change.key]) if change.key in fields else None

    def text(value: object) -> str:
        if value is None:
            return "nothing"
        if change.key not in fields:
            return str(value)
        return from_si(value, unit) if unit and isinstance(value, float) else display(value, fields[change.key])

    return f"{change.key}: {text(change.old)} -> {text(change.new)}"


def reason(verdict: Verdict, case: Case) -> str:
    """Say why a stage will run or not."""
    if not verdict.stale:
        return "up to date"
    if verdict.missing:
        return "no product yet"
    changes = [change_text(change, case) for change in verdict.changes]
    if len(changes) > LONGEST_LIST:
        changes = [*changes[:LONGEST_LIST], f"and {len(changes) - LONGEST_LIST} more"]
    if verdict.because_of:
        changes.append("follows " + ", ".join(verdict.because_of))
    return "\n".join(changes)


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", expand=True, show_edge=False, pad_edge=False)
    for position, name in enumerate(columns):
        last = position == len(columns) - 1
        table.add_column(name, no_wrap=not last, ratio=1 if last else None)
    return table


def _stages(case: Case, run_folder: Path, outlook: Forecast) -> Table:
    table = _table(f"Stages, in {run_folder}", "stage", "", "cost", "why")
    for name, verdict in examine(run_folder, case).items():
        mark = "[yellow]run[/]" if verdict.stale else "[green]skip[/]"
        seconds = outlook.seconds.get(name)
        cost = f"about {duration(seconds)}" if verdict.stale and seconds is not None else ""
        table.add_row(name, mark, cost, reason(verdict, case))
    return table


def _effects(outlook: Forecast) -> Table:
    table = _table("\nEffects of the reflow", "effect", "", "why")
    for name, decision in outlook.effects.items():
        mark = "[green]on[/]" if decision["on"] else "[dim]off[/]"
        table.add_row(name.replace("_", " "), mark, decision["why"])
    return table


def duration(seconds: float) -> str:
    """Write a wall time with two digits."""
    return f"{seconds:.2g} s" if seconds < 100 else f"{seconds / 60:.2g} min"


def micro(seconds: float) -> str:
    """Write a time step."""
    return f"{in_unit(seconds, 'ns'):.3g} ns"
