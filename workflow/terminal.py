"""What the user sees: one console, errors, one health line a stage."""

import os

from rich.console import Console
from rich.markup import escape

from workflow.check_text import against_limit

# A terminal has its own width; a file or a pipe gets lines that a report or a log can hold.
WIDTH = None if os.isatty(1) else 100
console = Console(width=WIDTH, highlight=False)
errors = Console(stderr=True, width=None if os.isatty(2) else 200, highlight=False)


def print_error(text: str) -> None:
    """Print an error, its first line emphasised."""
    first, _, rest = text.partition("\n")
    errors.print(f"[bold red]error[/] {escape(first)}", soft_wrap=True)
    if rest:
        errors.print(escape(rest), soft_wrap=True)


def health_line(stage: str, seconds: float, health: dict, continued: str = "") -> None:
    """Print how a stage ended: its time, the checks that did not hold, or else the one closest to its limit.

    Args:
        stage: its name.
        seconds: its time.
        health: check -> value, limit, ok.
        continued: what continued from checkpoints, in words.
    """
    failed = [name for name, result in health.items() if not result["ok"]]
    mark = "[bold red]FAILED[/]" if failed else "[green]ok[/]    "
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
    console.print(f"{mark} [bold]{stage:<11}[/] {seconds:6.1f} s  {escape(text)}", soft_wrap=True)


def _against_limit(name: str, result: dict) -> str:
    value, limit = against_limit(name, result)
    return f"{name.replace('_', ' ')} {value} (limit {limit})"


def _closeness(result: dict) -> float:
    """How near a value that holds is to its limit, which it may exceed or fall below: 1 is at the limit."""
    smaller, larger = sorted((abs(result["value"]), abs(result["limit"])))
    return smaller / larger if larger > 0.0 else 0.0
