"""Terminal pages with all effects of the program and the effects of a case."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table

from reflowshock.effect import Effect
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.effects.registry import registry
from reflowshock.workflow.effects.table import CAPTION, HEAD, MEASURED, per_cent, read_measured_ratios, rows
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.process.terminal import new_table, style_text

FIELDS = (
    ("adds", "adds"),
    ("number", "number"),
    ("influence", "influence"),
    ("switch", "key"),
    ("implementation", "object"),
)


def show_registry(console: Console) -> None:
    """Print a table of all effects of the program for each stage: term, number, influence, switch, implementation.

    Args:
        console: Console to print to.
    """
    for stage in dict.fromkeys(effect.stage for effect in registry().values()):
        table = new_table(f"\nEffects of the {stage}", "effect", "", "description")
        for effect in registry().values():
            if effect.stage == stage:
                _add(table, effect)
        console.print(table)
    console.print(
        style_text("\n[dim]An effect that is off costs nothing. `reflowshock effects CASE` shows which effects act.")
    )


def _add(table: Table, effect: Effect) -> None:
    lines = [(title, getattr(effect, name)) for name, title in FIELDS]
    if effect.threshold is not None:
        lines.insert(2, ("threshold", f"acts {effect.acts} {effect.threshold:g}"))
    if effect.name in read_measured_ratios():
        lines.append(
            ("cost", f"adds {per_cent(read_measured_ratios()[effect.name] - 1.0)} to a step ({MEASURED.name})")
        )
    lines.append(("source", effect.source))
    for row, (title, text) in enumerate(lines):
        name = effect.name.replace("_", " ") if row == 0 else ""
        table.add_row(style_text("[bold]{}[/]", name), style_text("[dim]{}[/]", title), text)


def effects_table(case: Case, effects: Mapping[str, Any], of_what: str) -> Table:
    """Return the table of a case's effects for the terminal.

    Args:
        case: Case of the effects.
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.
        of_what: Noun for the title, such as the process on which the effects act.

    Returns:
        Table with one row per effect: name, on or off, expected influence, share of the predicted cost, reason.
    """
    table = new_table(f"\nEffects of the {of_what}", *HEAD)
    for name, acts, influence, cost, why in rows(case, effects):
        table.add_row(name, style_text("[green]on[/]" if acts else "[dim]off[/]"), influence, cost, why)
    for column in table.columns[2:4]:
        column.justify = "right"
    table.caption, table.caption_justify = CAPTION, "left"
    return table


def show_effects(case: Case, console: Console) -> None:
    """Print the table of a case's effects: on or off, expected influence, share of the predicted cost, why.

    Args:
        case: Case, from which effects and cost are predicted.
        console: Console to print to.
    """
    console.print(effects_table(case, dict(kind_of(case).forecast(case).effects), case.case.name))
