"""Results of a stress test: stress_test.json, .png and .html, and a TOML file per counterexample."""

import base64
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.ticker import LogFormatter

from reflowshock.cases.hard.hard_case import hard_case_text
from reflowshock.cases.hard.trial import FAMILIES
from reflowshock.cases.hard.verdict import Check, Verdict
from reflowshock.workflow import __version__
from reflowshock.workflow.report.drawing import STYLE
from reflowshock.workflow.report.template import template_environment
from reflowshock.workflow.stress_test.sample import Sample
from reflowshock.workflow.stress_test.words import sample_summary

TEMPLATES = Path(__file__).parent / "templates"
LEAST, MOST = 0.05, 1000.0  # margins outside are drawn at the edge
SURVIVED, MISSED, REFUSED = "#0b5fa5", "#b3261e", "#2a7d4f"
ROW = 0.19  # height of a row [in]


def write_results(folder: Path, verdicts: Sequence[Verdict], samples: Sequence[Sample], seed: int) -> None:
    """Write all results to a folder; counterexamples of earlier tests stay.

    Args:
        folder: Output folder.
        verdicts: Verdicts on the fixed cases.
        samples: Random cases.
        seed: Seed of the random cases.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for sample in samples:
        if sample.simplest is not None:
            path = folder / "counterexamples" / f"{sample.name}.toml"
            path.parent.mkdir(exist_ok=True)
            path.write_text(hard_case_text(sample.simplest), encoding="utf-8")
    draw_margins(folder / "stress_test.png", verdicts, samples)
    results = {
        "version": __version__,
        "seed": seed,
        "fixed": [_record(verdict) for verdict in verdicts],
        "random": [_sample_record(sample) for sample in samples],
    }
    (folder / "stress_test.json").write_text(json.dumps(results, indent=1), encoding="utf-8")
    (folder / "stress_test.html").write_text(_page(folder, verdicts, samples, seed), encoding="utf-8")


def _record(verdict: Verdict) -> dict[str, Any]:
    return {
        "name": verdict.case.name,
        "tried": verdict.case.tried,
        "family": verdict.case.family,
        "ok": verdict.ok,
        "refused": verdict.is_refused,
        "message": verdict.message,
        "seconds": round(verdict.seconds, 3),
        "checks": [_check(check) for check in verdict.checks],
    }


def _check(check: Check) -> dict[str, Any]:
    margin = check.margin if math.isfinite(check.margin) else None
    return {"measure": check.measure, "found": check.value, "bound": check.bound, "margin": margin, "ok": check.holds}


def _sample_record(sample: Sample) -> dict[str, Any]:
    return {
        "name": sample.name,
        "family": sample.family,
        "ok": sample.ok,
        "tried": len(sample.verdicts),
        "refused": sample.refused,
        "cases": [_record(verdict) | {"parameters": verdict.case.table} for verdict in sample.verdicts],
    }


def _page(folder: Path, verdicts: Sequence[Verdict], samples: Sequence[Sample], seed: int) -> str:
    environment = template_environment(TEMPLATES)
    environment.globals.update(sample_summary=sample_summary)
    in_order = sorted(verdicts, key=lambda verdict: (FAMILIES.index(verdict.case.family), verdict.case.name))
    return environment.get_template("stress_test.html.j2").render(
        version=__version__,
        seed=seed,
        verdicts=in_order,
        samples=samples,
        tried=sum(len(sample.verdicts) for sample in samples),
        missed=sum(not verdict.ok for verdict in verdicts) + sum(len(sample.missed) for sample in samples),
        refused=sum(sample.too_many_refused for sample in samples),
        picture=base64.b64encode((folder / "stress_test.png").read_bytes()).decode(),
    )


def draw_margins(path: Path, verdicts: Sequence[Verdict], samples: Sequence[Sample]) -> None:
    """Draw the margins of all cases to a PNG file.

    Args:
        path: Path of the PNG file.
        verdicts: Verdicts on the fixed cases.
        samples: Random cases, one row per sample with one dot per case.
    """
    rows = _rows(verdicts, samples)
    with pyplot.rc_context(STYLE | {"font.size": 8}):
        figure, axis = pyplot.subplots(figsize=(9.2, ROW * len(rows) + 1.2), constrained_layout=True)
        axis.axvspan(LEAST, 1.0, color=MISSED, alpha=0.07, lw=0)
        axis.axvline(1.0, color=MISSED, lw=1.2)
        for row, (name, row_verdicts) in enumerate(rows):
            _draw_row(axis, row, row_verdicts, 0.35 if "random" in name else 0.9)
        axis.set_yticks(range(len(rows)), [name.replace("_", " ") for name, _ in rows])
        axis.set(xscale="log", xlim=(LEAST, 1.3 * MOST), ylim=(len(rows) - 0.3, -0.7))
        axis.xaxis.set_major_formatter(LogFormatter())  # plain numbers, since STYLE cannot typeset formulas
        axis.set_xlabel("margin: bound over measured value (1: at the bound; left of it: a miss); square: refused")
        figure.savefig(path, dpi=110)
        pyplot.close(figure)


def _rows(verdicts: Sequence[Verdict], samples: Sequence[Sample]) -> list[tuple[str, list[Verdict]]]:
    """Return the names of files and samples with their verdicts, ordered by family."""
    rows: dict[str, list[Verdict]] = {}
    for family in FAMILIES:
        for verdict in sorted(verdicts, key=lambda item: item.case.name):
            if verdict.case.family == family:
                rows.setdefault(verdict.case.name, []).append(verdict)
        for sample in samples:
            if sample.family == family:
                rows[sample.name] = sample.verdicts
    return list(rows.items())


def _draw_row(axis: Axes, row: int, verdicts: Sequence[Verdict], opacity: float) -> None:
    """Draw the smallest margin of each verdict; broken and refused cases without a margin are drawn at an edge."""
    for verdict in verdicts:
        closest = verdict.closest
        margin = closest.margin if closest else (MOST if verdict.ok else LEAST)
        clipped = LEAST if math.isnan(margin) else min(MOST, max(LEAST, margin))
        colour = MISSED if not verdict.ok else REFUSED if verdict.is_refused else SURVIVED
        marker = "s" if verdict.is_refused else "o" if closest else "X"
        axis.plot(clipped, row, marker, color=colour, alpha=opacity, ms=5, mew=0, clip_on=False)
