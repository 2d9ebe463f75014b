"""Verdicts in the terminal: a line a case, and a table of the families."""

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from workflow.stress_test.families import FAMILIES
from workflow.stress_test.verdict import Check, Verdict
from workflow.terminal import console

LARGEST_SHOWN = 1000.0


def show_verdict(verdict: Verdict) -> None:
    """Print one verdict: what was tried, the closest bound, what was measured, the margin."""
    mark = "[green]ok  [/]" if verdict.ok else "[bold red]MISS[/]"
    console.print(f"{mark} {escape(named(verdict))}  {escape(said(verdict))}  {verdict.seconds:.1f} s", soft_wrap=True)


def named(verdict: Verdict) -> str:
    """Name a case with the values that were varied."""
    return verdict.name + (f" ({verdict.tried})" if verdict.tried else "")


def said(verdict: Verdict) -> str:
    """Say how a case ended: the closest of its checks, or why there is none; where it missed, all that it missed."""
    if verdict.message:
        return ("refused as it must be: " if verdict.is_expected else "") + verdict.message
    missed = [check for check in verdict.checks if not check.holds]
    closest = verdict.closest
    assert closest is not None
    return "; ".join(f"{check}, margin {margin_text(check)}" for check in missed or [closest])


def margin_text(check: Check) -> str:
    """Write a margin: by what factor a bound is kept."""
    return f"> {LARGEST_SHOWN:g}" if check.margin > LARGEST_SHOWN else f"{check.margin:.3g}"


def show_table(verdicts: Sequence[Verdict]) -> None:
    """Print how many of each family were tried and missed, and the closest of each."""
    table = Table(box=None, header_style="bold")
    for column in ("family", "tried", "missed", "smallest margin", "of"):
        table.add_column(column, justify="left" if column in ("family", "of") else "right")
    for family in FAMILIES:
        own = [verdict for verdict in verdicts if verdict.family == family]
        checked = [verdict for verdict in own if verdict.closest is not None]
        if own:
            least = min(checked, key=lambda verdict: verdict.closest.margin, default=None)  # type: ignore[union-attr]
            missed = sum(not verdict.ok for verdict in own)
            margin = margin_text(least.closest) if least and least.closest else ""
            table.add_row(family, str(len(own)), str(missed), margin, escape(named(least)) if least else "")
    console.print(table)
