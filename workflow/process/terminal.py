r"""What the user sees: one console that takes no text for markup, errors, tables, progress bars, health lines.

A title, a folder or a message may hold anything: brackets are shown as they are, control characters as ``\x1b``.
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
from reflowshock.workflow.process.progress_file import teller

REFLOW_SPEED = "Costs assume the reflow speed in particles/parameters/estimate.py, as benchmarks/ measured it."


# All that a terminal obeys (but for line end and tab), that turns the direction of text, or that no encoding has.
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
PLACE = "{}"
WIDTHS = {1: 100, 2: 200}  # of lines in a file or a pipe: what a report or a log can hold


def visible(text: str) -> str:
    r"""Return a text whose control characters are written out, as ``\x1b``."""
    return CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def styled(template: str, *values: object) -> Text:
    """Style the program's own words; each ``{}`` among them takes a value, which is no markup whatever it holds.

    Args:
        template: a constant with markup, as ``"[bold]{}[/] in {}"``.
        values: in the order of their places.
    """
    words = Text.from_markup(template, emoji=False)
    ends = [end for found in re.finditer(re.escape(PLACE), words.plain) for end in found.span()]
    pieces = list(words.divide(ends))
    for place, value in zip(range(1, len(pieces), 2), values, strict=True):
        line = visible(str(value))
        pieces[place] = Text(line, spans=[Span(0, len(line), span.style) for span in pieces[place].spans])
    return Text("").join(pieces)


class Terminal(Console):
    """A console that shows text as it is: no markup, no emoji, no colours but those of ``styled``, nothing obeyed."""

    def __init__(self, descriptor: int = 1, **options: Any) -> None:
        """Take standard output (1) or standard error (2); into a file or a pipe go no control sequences."""
        shown = _is_terminal(descriptor)
        width = None if shown else WIDTHS[descriptor]
        defaults = {"stderr": descriptor == 2, "width": width, "force_terminal": shown}
        super().__init__(**defaults | options, markup=False, emoji=False, highlight=False)

    def print(self, *objects: Any, soft_wrap: bool | None = None, **options: Any) -> None:
        """Print as ``Console.print``; lines that a file has as they are (``soft_wrap``) end on a terminal at words."""
        super().print(*objects, soft_wrap=soft_wrap and not self.is_terminal, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return text without markup (unless requested) and with visible control characters."""
        return super().render_str(visible(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the segments of anything; what it obeys are those of rich alone."""
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
    """Print an error, its first line emphasised."""
    first, _, rest = text.partition("\n")
    errors.print(styled("[bold red]error:[/] {}", first), soft_wrap=True)
    if rest:
        errors.print(rest, soft_wrap=True)


@contextmanager
def interruptible(what: str) -> Iterator[None]:
    """Exit with code 1 on Ctrl-C and print the given note."""
    try:
        yield
    except KeyboardInterrupt as error:
        print_error(f"interrupted; {what}")
        raise SystemExit(1) from error


def health_line(stage: str, seconds: float, health: dict, continued: str = "") -> None:
    """Print how a stage ended: its time, the checks that did not hold, or else the one closest to its limit.

    Args:
        stage: its name.
        seconds: its time.
        health: check -> value, limit, ok.
        continued: what continued from checkpoints, in words.
    """
    failed = [name for name, result in health.items() if not result["ok"]]
    mark = styled("[bold red]FAILED[/]") if failed else styled("[green]ok[/]    ")
    if failed:
        text = ", ".join(_against_limit(name, health[name]) for name in failed)
    elif health:
        closest = max(health, key=lambda name: _closeness(health[name]))
        checks = f"{len(health)} checks hold" if len(health) > 1 else "1 check holds"
        text = f"{checks}; closest: {_against_limit(closest, health[closest])}"
    else:
        text = "done"
    if continued:
        text += f"; {continued} continued from checkpoints"
    line = styled(" [bold]{}[/] {} s  {}", f"{stage:<11}", f"{seconds:6.1f}", text)
    console.print(mark + line, soft_wrap=True)


def _against_limit(name: str, result: dict) -> str:
    value, limit = against_limit(name, result)
    return f"{name.replace('_', ' ')} {value} (limit {limit})"


def _closeness(result: dict) -> float:
    """How near a value that holds is to its limit, which it may exceed or fall below: 1 is at the limit."""
    smaller, larger = sorted((abs(result["value"]), abs(result["limit"])))
    return smaller / larger if larger > 0.0 else 0.0


class ProgressBar(Protocol):
    """Is called with how far something is."""

    def __call__(self, share: float, text: str = "") -> None:
        """Take the share that is done, 0 to 1, and what is going on, which stands in place of the description."""


@contextmanager
def progress_bar(description: str) -> Iterator[ProgressBar]:
    """Show a bar with share, time spent and time left while something runs; it vanishes in the end.

    Where there is no terminal, only the description is printed. A second terminal sees it by ``status --follow``.

    Yields:
        What is called with the progress.
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
    tell = teller(description)
    with Progress(*columns, console=console, transient=True, disable=not moving) as bar:
        task = bar.add_task(visible(description), total=1.0)

        def show(share: float, text: str = "") -> None:
            bar.update(task, completed=share, description=visible(text or description))
            tell(share, text)

        yield show


def text_table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]], remarks: bool = False) -> Table:
    """Lay out rows of text; heads are broken into words, values are not: names and remarks in the last column are."""
    shown = Table(title=title or None, title_justify="left", title_style="bold", show_edge=False, pad_edge=False)
    for place, name in enumerate(head):
        last = remarks and place == len(head) - 1
        justify: Literal["left", "right"] = "left" if last or place == 0 else "right"
        shown.add_column(name.replace(" ", "\n"), no_wrap=not last and place > 0, justify=justify, overflow="fold")
    for row in rows:
        shown.add_row(*row)
    return shown


def new_table(title: str, *columns: str) -> Table:
    """Return an empty table; its last column takes what room is left."""
    table = Table(title=title, title_justify="left", title_style="bold", expand=True, show_edge=False, pad_edge=False)
    for position, name in enumerate(columns):
        last = position == len(columns) - 1
        table.add_column(name, no_wrap=not last, overflow="fold", ratio=1 if last else None)
    return table
