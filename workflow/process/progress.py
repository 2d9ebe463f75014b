"""Progress bars."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from reflowshock.workflow.process.terminal import console, visible


class ProgressBar(Protocol):
    """What is told how far something is."""

    def __call__(self, share: float, text: str = "") -> None:
        """Take the share that is done, 0 to 1, and what is going on, which stands in place of the description."""


@contextmanager
def progress_bar(description: str) -> Iterator[ProgressBar]:
    """Show a bar with share, time spent and time left while something runs; it vanishes in the end.

    Where there is no terminal, only the description is printed.

    Yields:
        What is to be told.
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
    with Progress(*columns, console=console, transient=True, disable=not moving) as bar:
        task = bar.add_task(visible(description), total=1.0)
        yield lambda share, text="": bar.update(task, completed=share, description=visible(text or description))
