r"""Terminal output: console without markup, errors, tables, progress bars, health lines.

Titles, paths and messages are printed literally: brackets stay as they are, control characters appear as ``\x1b``.
"""

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal, Protocol

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.segment import Segment
from rich.table import Table
from rich.text import Span, Text

from reflowshock.workflow.case.text import against_limit
from reflowshock.workflow.process.progress_file import progress_writer

REFLOW_SPEED = "Costs assume the reflow speed in particles/parameters/estimate.py, as benchmarks/ measured it."


# Control characters (except line end and tab), marks of text direction, and surrogates without an encoding.
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
PLACE = "{}"
WIDTHS = {1: 100, 2: 200}  # line width in a file or a pipe


def visible(text: str) -> str:
    r"""Return text with control characters written as escapes such as ``\x1b``."""
    return CONTROL.sub(lambda match: match[0].encode("unicode_escape").decode(), text)


def style_text(template: str, *values: object) -> Text:
    """Style a template with markup and insert values, which are never interpreted as markup.

    Args:
        template: Constant with markup and one ``{}`` per value, such as ``"[bold]{}[/] in {}"``.
        values: Values in the order of their placeholders.
    """
    words = Text.from_markup(template, emoji=False)
    ends = [end for match in re.finditer(re.escape(PLACE), words.plain) for end in match.span()]
    pieces = list(words.divide(ends))
    for position, value in zip(range(1, len(pieces), 2), values, strict=True):
        line = visible(str(value))
        pieces[position] = Text(line, spans=[Span(0, len(line), span.style) for span in pieces[position].spans])
    return Text("").join(pieces)


class Terminal(Console):
    """Console that prints text literally: no markup, no emoji, no colours except those of ``style_text``."""

    def __init__(self, descriptor: int = 1, **options: Any) -> None:
        """Open standard output (1) or standard error (2); files and pipes receive no control sequences."""
        is_terminal = _is_terminal(descriptor)
        width = None if is_terminal else WIDTHS[descriptor]
        defaults = {"stderr": descriptor == 2, "width": width, "force_terminal": is_terminal}
        super().__init__(**defaults | options, markup=False, emoji=False, highlight=False)

    def print(self, *objects: Any, soft_wrap: bool | None = None, **options: Any) -> None:
        """Print like ``Console.print``; with ``soft_wrap``, lines are wrapped at words on terminals only."""
        super().print(*objects, soft_wrap=soft_wrap and not self.is_terminal, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return text without markup (unless requested) and with visible control characters."""
        return super().render_str(visible(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the segments of a renderable; only rich itself may emit control segments."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=visible(segment.text))


def _is_terminal(descriptor: int) -> bool:
    try:
        return os.isatty(descriptor)
    except OSError:  # it is closed
        return False


console = Terminal()
errors = Terminal(2)


def print_error(text: str) -> None:
    """Print an error on standard error, its first line after "error:"; further lines follow unchanged."""
    first, _, rest = text.partition("\n")
    errors.print(style_text("[bold red]error:[/] {}", first), soft_wrap=True)
    if rest:
        errors.print(rest, soft_wrap=True)


@contextmanager
def interruptible(what: str) -> Iterator[None]:
    """Exit with code 1 and print a note if the user presses Ctrl-C in the ``with`` block.

    Args:
        what: Note to the user, such as how to continue.
    """
    try:
        yield
    except KeyboardInterrupt as error:
        print_error(f"interrupted; {what}")
        raise SystemExit(1) from error


def health_line(stage: str, seconds: float, health: dict, continued: str = "") -> None:
    """Print the result of a stage: time, failed checks, or otherwise the check closest to its limit.

    Args:
        stage: Name of the stage.
        seconds: Wall time of the stage [s].
        health: Value, limit and ok by name of the check.
        continued: Names of parts that continued from checkpoints, or empty.
    """
    failed = [name for name, result in health.items() if not result["ok"]]
    mark = style_text("[bold red]FAILED[/]") if failed else style_text("[green]ok[/]    ")
    if failed:
        text = ", ".join(_against_limit(name, health[name]) for name in failed)
    elif health:
        closest = max(health, key=lambda name: _closeness(health[name]))
        checks = f"{len(health)} checks passed" if len(health) > 1 else "1 check passed"
        text = f"{checks}; closest: {_against_limit(closest, health[closest])}"
    else:
        text = "done"
    if continued:
        text += f"; {continued} continued from checkpoints"
    line = style_text(" [bold]{}[/] {} s  {}", f"{stage:<11}", f"{seconds:6.1f}", text)
    console.print(mark + line, soft_wrap=True)


def _against_limit(name: str, result: dict) -> str:
    value, limit = against_limit(name, result)
    return f"{name.replace('_', ' ')} {value} (limit {limit})"


def _closeness(result: dict) -> float:
    """Return the ratio of a passing value and its limit, the smaller over the larger: 1 is at the limit."""
    smaller, larger = sorted((abs(result["value"]), abs(result["limit"])))
    return smaller / larger if larger > 0.0 else 0.0


class ProgressBar(Protocol):
    """Callback that updates a progress bar."""

    def __call__(self, share: float, text: str = "") -> None:
        """Set the completed share, 0 to 1, and a text that replaces the description."""


@contextmanager
def progress_bar(description: str) -> Iterator[ProgressBar]:
    """Show a transient progress bar during a ``with`` block: share, elapsed time and remaining time.

    Without a terminal, only the description is printed. ``status --follow`` shows the bar in a second terminal.

    Args:
        description: Name of the activity.

    Yields:
        Function of the completed share, 0 to 1, and optionally a text that replaces the description.
    """
    columns = (
        TextColumn("  {task.description}", markup=False),
        BarColumn(bar_width=30),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    moving = console.is_terminal and not console.is_dumb_terminal
    if not moving:
        console.print(f"       {description} …", soft_wrap=True)
    write_progress = progress_writer(description)
    with Progress(*columns, console=console, transient=True, disable=not moving) as bar:
        task = bar.add_task(visible(description), total=1.0)

        def show(share: float, text: str = "") -> None:
            bar.update(task, completed=share, description=visible(text or description))
            write_progress(share, text)

        yield show


def text_table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]], remarks: bool = False) -> Table:
    """Return a table of text for the terminal.

    Column titles wrap at words, values only in the first column and in remarks.

    Args:
        title: Title; empty for none.
        head: Column titles.
        rows: Cells of each row, one per column.
        remarks: Whether the last column holds remarks, which wrap and are left-aligned.
    """
    table = Table(title=title or None, title_justify="left", title_style="bold", show_edge=False, pad_edge=False)
    for column, name in enumerate(head):
        last = remarks and column == len(head) - 1
        justify: Literal["left", "right"] = "left" if last or column == 0 else "right"
        table.add_column(name.replace(" ", "\n"), no_wrap=not last and column > 0, justify=justify, overflow="fold")
    for row in rows:
        table.add_row(*row)
    return table


def new_table(title: str, *columns: str) -> Table:
    """Return an empty table for the terminal, whose last column takes the remaining width.

    Args:
        title: Title of the table.
        columns: Column titles.
    """
    table = Table(title=title, title_justify="left", title_style="bold", expand=True, show_edge=False, pad_edge=False)
    for position, name in enumerate(columns):
        last = position == len(columns) - 1
        table.add_column(name, no_wrap=not last, overflow="fold", ratio=1 if last else None)
    return table
