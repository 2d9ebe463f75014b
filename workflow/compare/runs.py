"""Comparison of runs: parameters, verdicts, metrics, joints, histories."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.pipeline.points import read_case_of_run
from reflowshock.workflow.pipeline.report import collect_summary
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.report.tables import named_quantity
from reflowshock.workflow.verdict.criteria import BY_NAME
from reflowshock.workflow.verdict.ratios import RATIOS, ratio_of

MODES = ("two_scale", "dns", "explicit", "implicit")  # the first mode of a run is compared
NONE = "–"
SMALLEST_CHANGE = 1e-4  # relative difference below which two values count as equal
FIRST = (
    "critical_joint", "peel_stress", "layer_von_mises", "layer_plastic_work", "section_axial_force",
    "section_bending_moment", "peak_acceleration@package", "peak_board_strain", "peak_board_displacement",
    "standoff_min", "standoff_max", "joint_width_max", "height", "max_width", "contact_angle", "first_frequency",
    "discretisation_error",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class ComparedRun:
    """Run in a comparison.

    Attributes:
        name: Name of its folder; the whole path if another run has the same name.
        case: Resolved case.
        summary: Content of ``summary.json``; for an incomplete run, the findings of its stages.
        history: Arrays of the first mode; empty without a shock.
    """

    name: str
    case: Case
    summary: Mapping[str, Any]
    history: Mapping[str, NDArray]


def read_runs(folders: Sequence[Path]) -> list[ComparedRun]:
    """Read two or more run folders; nothing is written.

    Args:
        folders: Run folders of the same kind of case.

    Returns:
        Name, resolved case, summary and history arrays of each run, in the order of the folders.

    Raises:
        CaseError: Fewer than two folders, a repeated one, one that is not a run folder, or different kinds of case.
    """
    if len(folders) < 2:
        raise CaseError("compare", [Problem("", "requires two or more run folders", len(folders), "2 or more")])
    resolved = [folder.resolve() for folder in folders]
    repeated = next((folder for k, folder in enumerate(folders) if resolved[k] in resolved[:k]), None)
    if repeated is not None:
        raise CaseError(str(repeated), [Problem("", "is given twice")])
    last = [folder.name for folder in resolved]
    names = [str(folder) if last.count(name) > 1 else name for folder, name in zip(folders, last, strict=True)]
    runs = [_read(folder, name) for folder, name in zip(folders, names, strict=True)]
    other = next((run for run in runs if kind_of(run.case) is not kind_of(runs[0].case)), None)
    if other is not None:
        kinds = [kind_of(run.case).name for run in (runs[0], other)]
        message = f"is a run of kind [{kinds[1]}], but {runs[0].name} is of kind [{kinds[0]}]"
        raise CaseError(other.name, [Problem("", message)])
    return runs


def _read(folder: Path, name: str) -> ComparedRun:
    case = read_case_of_run(folder)
    path = folder / "summary.json"
    summary = read_json(path) if path.exists() else collect_summary(folder, case)
    paths = (folder / "shock" / mode / "history.npz" for mode in MODES)
    history = next((path for path in paths if path.exists()), None)
    if history is None:
        return ComparedRun(name, case, summary, {})
    with np.load(history) as arrays:
        return ComparedRun(name, case, summary, dict(arrays))


def parameters(runs: Sequence[ComparedRun]) -> dict:
    """Return the table of parameters in which runs differ.

    Args:
        runs: Two or more runs.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): key of the parameter, and its value in each
        run in the user's unit; missing values are "–".
    """
    values = [display_values(run.case) for run in runs]
    keys = dict.fromkeys(key for texts in values for key in texts if not key.startswith("case."))
    rows = [[key, *(texts.get(key, NONE) for texts in values)] for key in keys]
    return _table("parameter", runs, [row for row in rows if len(set(row[1:])) > 1])


def results(runs: Sequence[ComparedRun]) -> dict:
    """Return the table of verdicts and metrics of runs, the most important first.

    Args:
        runs: Two or more runs.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): name, and value in each run with its change
        relative to the first run; missing values are "–".
    """
    metrics = [run.summary["metrics"] for run in runs]
    names = dict.fromkeys([*FIRST, *(name for run_metrics in metrics for name in run_metrics)])
    rows = [
        [
            name.replace("_", " "),
            *_texts([run_metrics.get(name) for run_metrics in metrics], partial(_text, name)),
        ]
        for name in names
        if any(name in run_metrics for run_metrics in metrics)
    ]
    return _table("result", runs, [*_verdicts(runs), *_ratios(runs), *rows])


def select_differing(table: Mapping[str, Any]) -> dict:
    """Return a table with only the rows in which columns differ.

    Args:
        table: Table with ``head`` (column titles) and ``rows`` (lists of text), whose first column is a name.
    """
    return {"head": table["head"], "rows": [row for row in table["rows"] if len(set(row[1:])) > 1]}


def joints(runs: Sequence[ComparedRun]) -> dict | None:
    """Return the table of peak peel stress of the joints that all runs have, ordered by their rank in the first run.

    Args:
        runs: Two or more runs.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): joint, peak in each run, and its rank in each
        run in the last column; None unless all runs have a shock.
    """
    from reflowshock.workflow.report.histories import peel_peaks

    if not all("peel_board" in run.history for run in runs):
        return None
    peaks = [peel_peaks(run.history) for run in runs]
    rows = []
    for name in peaks[0]:
        if all(name in run_peaks for run_peaks in peaks):
            metrics = [{"value": run_peaks[name], "unit": "Pa"} for run_peaks in peaks]
            ranks = [list(run_peaks).index(name) + 1 for run_peaks in peaks]
            rows.append([name, *_texts(metrics, _stress), " / ".join(map(str, ranks))])
    return {"head": ["peel stress of joint", *(run.name for run in runs), "rank"], "rows": rows}


def _stress(metric: Mapping[str, Any]) -> str:
    return f"{1e-6 * metric['value']:.4g} MPa"


def _verdicts(runs: Sequence[ComparedRun]) -> list[list[str]]:
    """Return the rows of health, verdict, deciding criterion and smallest margin, if the runs have them."""
    failed = [
        [name.replace("_", " ") for name, check in run.summary["health"].items() if not check["ok"]] for run in runs
    ]
    rows = [["health", *(f"failed: {', '.join(names)}" if names else "passed" for names in failed)]]
    verdicts = [run.summary.get("verdict") for run in runs]
    if any(verdicts):
        rows.append(
            ["verdict on the design", *(NONE if verdict is None else verdict["design"] for verdict in verdicts)]
        )
        deciding = [None if verdict is None else _deciding(verdict) for verdict in verdicts]
        names = [NONE if record is None else BY_NAME[record["name"]].words for record in deciding]
        margins = [None if record is None else record["margin"] for record in deciding]
        rows += [["deciding criterion", *names]] if any(deciding) else []
        if any(margin is not None for margin in margins):
            rows.append(["smallest margin", *(NONE if margin is None else f"{margin:.3g}" for margin in margins)])
    return rows


def _deciding(verdict: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return the record of the criterion that decides a verdict; None if none applies."""
    return next((record for record in verdict["criteria"] if record["name"] == verdict["criterion"]), None)


def _ratios(runs: Sequence[ComparedRun]) -> list[list[str]]:
    """Return the rows of load ratios to the first run, as in the verdict against a reference; empty without a drop."""
    first, *others = [run.summary["metrics"] for run in runs]
    if "critical_joint" not in first:
        return []
    rows = []
    for name, words in RATIOS.items():
        values = [ratio_of(name, metrics, first).value for metrics in others]
        if any(value is not None for value in values):
            texts = [NONE if value is None else f"{value:.3g}" for value in values]
            rows.append([f"{words} relative to {runs[0].name}", "1", *texts])
    return rows


def _texts(metrics: Sequence[Mapping | None], text: Callable[[Mapping], str]) -> list[str]:
    """Write values; those after the first with their relative change, if it is defined."""
    first, *others = metrics
    texts = [NONE if first is None else text(first)]
    for metric in others:
        change = "" if first is None or metric is None else _change(first["value"], metric["value"])
        texts.append(NONE if metric is None else text(metric) + change)
    return texts


def _change(first: Any, other: Any) -> str:
    """Write the relative change between two values; empty if it is negligible or undefined."""
    if any(isinstance(value, str | bool) or value is None for value in (first, other)) or not first:
        return ""
    share = other / first - 1.0
    if abs(share) < SMALLEST_CHANGE:
        return ""
    return f" ({other / first:.3g} times)" if share > 1.0 else f" ({100.0 * share:+.3g} %)"


def _text(name: str, metric: Mapping[str, Any]) -> str:
    return named_quantity({name: dict(metric)}, name)


def _table(what: str, runs: Sequence[ComparedRun], rows: list[list[str]]) -> dict:
    return {"head": [what, *(run.name for run in runs)], "rows": rows}
