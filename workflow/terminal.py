"""What the user sees: one console, errors, one health line a stage."""

import os

from rich.console import Console
from rich.markup import escape

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


def health_line(stage: str, seconds: float, health: dict) -> None:
    """Print how a stage ended: its time, and each health check against its limit."""
    good = all(check["ok"] for check in health.values())
    mark = "[green]ok[/]    " if good else "[bold red]FAILED[/]"
    checks = ", ".join(
        f"{name.replace('_', ' ')} {check['value']:.2g} ({'ok' if check['ok'] else 'NOT'} within {check['limit']:.2g})"
        if not isinstance(check["value"], str)
        else f"{name.replace('_', ' ')} {check['value']}"
        for name, check in health.items()
    )
    console.print(f"{mark} [bold]{stage:<11}[/] {seconds:7.1f} s  {escape(checks)}", soft_wrap=True)
