"""Picture of a stress test: by what factor each case kept its closest bound, a row a file, by family."""

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.ticker import LogFormatter

from reflowshock.workflow.report.curves import STYLE
from reflowshock.workflow.stress_test.families import FAMILIES
from reflowshock.workflow.stress_test.sample import Sample
from reflowshock.workflow.stress_test.verdict import Verdict

LEAST, MOST = 0.05, 1000.0  # margins beyond are drawn at the edge
SURVIVED, MISSED, REFUSED = "#0b5fa5", "#b3261e", "#2a7d4f"
ROW = 0.19  # height of a row [in]


def draw_margins(path: Path, verdicts: Sequence[Verdict], samples: Sequence[Sample]) -> None:
    """Write a PNG.

    Args:
        path: of the file.
        verdicts: of the fixed cases.
        samples: random cases; their row has a dot for each.
    """
    rows = _rows(verdicts, samples)
    with pyplot.rc_context(STYLE | {"font.size": 8}):
        figure, axis = pyplot.subplots(figsize=(9.2, ROW * len(rows) + 1.2), constrained_layout=True)
        axis.axvspan(LEAST, 1.0, color=MISSED, alpha=0.07, lw=0)
        axis.axvline(1.0, color=MISSED, lw=1.2)
        for place, (name, own) in enumerate(rows):
            _draw_row(axis, place, own, 0.35 if "random" in name else 0.9)
        axis.set_yticks(range(len(rows)), [name.replace("_", " ") for name, _ in rows])
        axis.set(xscale="log", xlim=(LEAST, 1.3 * MOST), ylim=(len(rows) - 0.3, -0.7))
        axis.xaxis.set_major_formatter(LogFormatter())  # no formula, which STYLE does not write
        axis.set_xlabel("margin: bound over measured value (1: at the bound; left of it: a miss); square: refused")
        figure.savefig(path, dpi=110)
        pyplot.close(figure)


def _rows(verdicts: Sequence[Verdict], samples: Sequence[Sample]) -> list[tuple[str, list[Verdict]]]:
    """Names of files and random trials with their verdicts, family by family."""
    rows: dict[str, list[Verdict]] = {}
    for family in FAMILIES:
        for verdict in sorted(verdicts, key=lambda one: one.case.name):
            if verdict.case.family == family:
                rows.setdefault(verdict.case.name, []).append(verdict)
        for sample in samples:
            if sample.family == family:
                rows[sample.trial.name] = sample.verdicts
    return list(rows.items())


def _draw_row(axis: Axes, place: int, verdicts: Sequence[Verdict], opacity: float) -> None:
    """Draw the closest margin of each verdict; a case that broke, or was refused, has none and lies at an edge."""
    for verdict in verdicts:
        closest = verdict.closest
        margin = closest.margin if closest else (MOST if verdict.ok else LEAST)
        shown = LEAST if math.isnan(margin) else min(MOST, max(LEAST, margin))
        colour = MISSED if not verdict.ok else REFUSED if verdict.is_refused else SURVIVED
        marker = "s" if verdict.is_refused else "o" if closest else "X"
        axis.plot(shown, place, marker, color=colour, alpha=opacity, ms=5, mew=0, clip_on=False)
