"""Verdicts in the terminal: a line a case, and a table of the families."""

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from reflowshock.workflow.process.terminal import console, styled
from reflowshock.workflow.stress_test.families import FAMILIES
from reflowshock.workflow.stress_test.sample import Sample
from reflowshock.workflow.stress_test.verdict import Check, Verdict

LARGEST_SHOWN = 1000.0


def show_verdict(verdict: Verdict) -> None:
    """Print one verdict: what was tried, the closest bound, what was measured, the margin."""
    told = styled(" {}  {}  {} s", named(verdict), said(verdict), f"{verdict.seconds:.1f}")
    console.print(_mark(verdict.ok) + told, soft_wrap=True)


def _mark(ok: bool) -> Text:
    return styled("[green]ok  [/]" if ok else "[bold red]MISS[/]")


def named(verdict: Verdict) -> str:
    """Name a case with the values that were varied."""
    return verdict.case.name + (f" ({verdict.case.tried})" if verdict.case.tried else "")


def said(verdict: Verdict) -> str:
    """Say how a case ended: the closest of its checks, or why there is none; where it missed, all that it missed."""
    if verdict.message:
        return ("refused: " if verdict.is_refused else "") + verdict.message
    missed = [check for check in verdict.checks if not check.holds]
    closest = verdict.closest
    assert closest is not None
    return "; ".join(f"{check}, margin {margin_text(check)}" for check in missed or [closest])


def margin_text(check: Check) -> str:
    """Write a margin: by what factor a bound is kept."""
    return f"> {LARGEST_SHOWN:g}" if check.margin > LARGEST_SHOWN else f"{check.margin:.3g}"


def show_sample(sample: Sample) -> None:
    """Print how the random cases of a trial ended, and what was missed."""
    seconds = f"{sum(verdict.seconds for verdict in sample.verdicts):.1f}"
    told = styled(" {}  {}  {} s", sample.trial.name, sample_said(sample), seconds)
    console.print(_mark(sample.ok) + told, soft_wrap=True)
    for verdict in sample.missed:
        console.print(f"     {named(verdict)}  {said(verdict)}", soft_wrap=True)


def sample_said(sample: Sample) -> str:
    """Say how the random cases of a trial ended."""
    counts = f"{len(sample.verdicts)} tried, {sample.refused} refused, {len(sample.missed)} missed"
    if sample.too_many_refused:
        counts += f"; allowed to be refused: {sample.trial.most_refused:.0%}"
    return counts + (f"; closest: {sample.closest}, margin {margin_text(sample.closest)}" if sample.closest else "")


def show_table(verdicts: Sequence[Verdict], samples: Sequence[Sample]) -> None:
    """Print how many of each family were tried and missed, the closest of each, and what was refused too often."""
    table = Table(box=None, header_style="bold")
    for column in ("family", "fixed", "random", "missed", "smallest margin", "of"):
        table.add_column(column, justify="left" if column in ("family", "of") else "right")
    for family in FAMILIES:
        fixed = [verdict for verdict in verdicts if verdict.case.family == family]
        drawn = [verdict for sample in samples if sample.family == family for verdict in sample.verdicts]
        if own := [*fixed, *drawn]:
            missed = sum(not verdict.ok for verdict in own)
            table.add_row(family, str(len(fixed)), str(len(drawn)), str(missed), *_least(own))
    console.print(table)
    for sample in samples:
        if sample.too_many_refused:
            show_sample(sample)


def _least(verdicts: Sequence[Verdict]) -> tuple[str, str]:
    """The smallest margin of all, and whose it is."""
    found = [(verdict.closest, verdict) for verdict in verdicts if verdict.closest is not None]
    if not found:
        return "", ""
    check, verdict = min(found, key=lambda pair: pair[0].rank)
    return margin_text(check), named(verdict)
