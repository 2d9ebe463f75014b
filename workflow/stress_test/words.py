"""Verdicts in the terminal: one line per case, and a table of families."""

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from reflowshock.cases.hard.trial import FAMILIES
from reflowshock.cases.hard.verdict import Verdict
from reflowshock.workflow.process.terminal import console, style_text
from reflowshock.workflow.stress_test.sample import MOST_REFUSED, Sample


def show_verdict(verdict: Verdict) -> None:
    """Print one verdict: case, closest bound, measured value, margin.

    Args:
        verdict: Result of one hard case: checks with bound and measured value, or a message.
    """
    line = style_text(" {}  {}  {} s", name_case(verdict), str(verdict), f"{verdict.seconds:.1f}")
    console.print(_mark(verdict.ok) + line, soft_wrap=True)


def _mark(ok: bool) -> Text:
    return style_text("[green]ok  [/]" if ok else "[bold red]MISS[/]")


def name_case(verdict: Verdict) -> str:
    """Return the name of a case with its varied values.

    Args:
        verdict: Result of one hard case.
    """
    return verdict.case.name + (f" ({verdict.case.tried})" if verdict.case.tried else "")


def show_sample(sample: Sample) -> None:
    """Print the results of the random cases of one file: their numbers, and the cases outside of their bounds.

    Args:
        sample: Random cases of one file, with their results.
    """
    seconds = f"{sum(verdict.seconds for verdict in sample.verdicts):.1f}"
    line = style_text(" {}  {}  {} s", sample.name, sample_summary(sample), seconds)
    console.print(_mark(sample.ok) + line, soft_wrap=True)
    for verdict in sample.missed:
        console.print(f"     {name_case(verdict)}  {verdict!s}", soft_wrap=True)


def sample_summary(sample: Sample) -> str:
    """Return one line on the random cases of one file: numbers of cases, misses and refusals.

    A miss is a case outside of its bounds; a refusal is a case that the program rejects before it runs.

    Args:
        sample: Random cases of one file, with their results.
    """
    counts = f"{len(sample.verdicts)} tried, {sample.refused} refused, {len(sample.missed)} missed"
    if sample.too_many_refused:
        counts += f"; allowed to be refused: {MOST_REFUSED:.0%}"
    return counts + (f"; closest: {sample.closest}, margin {sample.closest.margin_text}" if sample.closest else "")


def show_table(verdicts: Sequence[Verdict], samples: Sequence[Sample]) -> None:
    """Print a table of tried and missed cases and the smallest margin per family, then samples with too many refusals.

    Args:
        verdicts: Results of the fixed cases.
        samples: Random cases of each file, with their results.
    """
    table = Table(box=None, header_style="bold")
    for column in ("family", "fixed", "random", "missed", "smallest margin", "of"):
        table.add_column(column, justify="left" if column in ("family", "of") else "right")
    for family in FAMILIES:
        fixed = [verdict for verdict in verdicts if verdict.case.family == family]
        drawn = [verdict for sample in samples if sample.family == family for verdict in sample.verdicts]
        if all_verdicts := [*fixed, *drawn]:
            missed = sum(not verdict.ok for verdict in all_verdicts)
            table.add_row(family, str(len(fixed)), str(len(drawn)), str(missed), *_least(all_verdicts))
    console.print(table)
    for sample in samples:
        if sample.too_many_refused:
            show_sample(sample)


def _least(verdicts: Sequence[Verdict]) -> tuple[str, str]:
    """Return the smallest margin and its case."""
    pairs = [(verdict.closest, verdict) for verdict in verdicts if verdict.closest is not None]
    if not pairs:
        return "", ""
    check, verdict = min(pairs, key=lambda pair: pair[0].rank)
    return check.margin_text, name_case(verdict)
