"""What runs have in common and where they differ: parameters, verdicts, metrics, joints, histories."""

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

MODES = ("two_scale", "dns", "explicit", "implicit")  # the first that a run has is compared
NONE = "–"
SMALLEST_CHANGE = 1e-4  # share; below it two values are the same
FIRST = (
    "critical_joint", "peel_stress", "layer_von_mises", "layer_plastic_work", "section_axial_force",
    "section_bending_moment", "peak_acceleration@package", "peak_board_strain", "peak_board_displacement",
    "standoff_min", "standoff_max", "joint_width_max", "height", "max_width", "contact_angle", "first_frequency",
    "discretisation_error",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class ComparedRun:
    """A run.

    Attributes:
        name: of its folder; the whole path where another one has this name.
        case: the resolved case.
        summary: ``summary.json``, or of a run that has not come to its end what its stages found.
        history: arrays of the first mode; empty without any.
    """

    name: str
    case: Case
    summary: Mapping[str, Any]
    history: Mapping[str, NDArray]


def read_runs(folders: Sequence[Path]) -> list[ComparedRun]:
    """Read two or more run folders.

    Raises:
        CaseError: fewer than two, one twice, one that is no run folder, or runs of different kinds of case.
    """
    if len(folders) < 2:
        raise CaseError("compare", [Problem("", "needs two or more run folders", len(folders), "2 or more")])
    resolved = [folder.resolve() for folder in folders]
    twice = next((folder for k, folder in enumerate(folders) if resolved[k] in resolved[:k]), None)
    if twice is not None:
        raise CaseError(str(twice), [Problem("", "is given twice")])
    last = [folder.name for folder in resolved]
    names = [str(folder) if last.count(name) > 1 else name for folder, name in zip(folders, last, strict=True)]
    runs = [_read(folder, name) for folder, name in zip(folders, names, strict=True)]
    other = next((run for run in runs if kind_of(run.case) is not kind_of(runs[0].case)), None)
    if other is not None:
        kinds = [kind_of(run.case).name for run in (runs[0], other)]
        message = f"is a run of another kind of case, [{kinds[1]}], than {runs[0].name}, [{kinds[0]}]"
        raise CaseError(other.name, [Problem("", message)])
    return runs


def _read(folder: Path, name: str) -> ComparedRun:
    case = read_case_of_run(folder)
    path = folder / "summary.json"
    summary = read_json(path) if path.exists() else collect_summary(folder, case)
    found = (folder / "shock" / mode / "history.npz" for mode in MODES)
    history = next((path for path in found if path.exists()), None)
    if history is None:
        return ComparedRun(name, case, summary, {})
    with np.load(history) as arrays:
        return ComparedRun(name, case, summary, dict(arrays))


def parameters(runs: Sequence[ComparedRun]) -> dict:
    """Return the parameters in which the runs differ, each run a column."""
    values = [display_values(run.case) for run in runs]
    keys = dict.fromkeys(key for one in values for key in one if not key.startswith("case."))
    rows = [[key, *(one.get(key, NONE) for one in values)] for key in keys]
    return _table("parameter", runs, [row for row in rows if len(set(row[1:])) > 1])


def answers(runs: Sequence[ComparedRun]) -> dict:
    """Return verdict and metrics of the runs, what matters most first; each but the first with its change."""
    metrics = [run.summary["metrics"] for run in runs]
    names = dict.fromkeys([*FIRST, *(name for one in metrics for name in one)])
    rows = [
        [
            name.replace("_", " "),
            *_texts([one.get(name) for one in metrics], partial(_text, name)),
        ]
        for name in names
        if any(name in one for one in metrics)
    ]
    return _table("answer", runs, [*_verdicts(runs), *rows])


def differing(table: Mapping[str, Any]) -> dict:
    """Return the rows of a table in which its columns differ."""
    return {"head": table["head"], "rows": [row for row in table["rows"] if len(set(row[1:])) > 1]}


def joints(runs: Sequence[ComparedRun]) -> dict | None:
    """Return the peak peel stress of every joint that all runs have, the most stressed of the first run first."""
    from reflowshock.workflow.report.histories import peel_peaks

    if not all("peel_board" in run.history for run in runs):
        return None
    peaks = [peel_peaks(run.history) for run in runs]
    rows = []
    for name in peaks[0]:
        if all(name in one for one in peaks):
            metrics = [{"value": one[name], "unit": "Pa"} for one in peaks]
            ranks = [list(one).index(name) + 1 for one in peaks]
            rows.append([name, *_texts(metrics, _stress), " / ".join(map(str, ranks))])
    return {"head": ["peel stress of joint", *(run.name for run in runs), "rank"], "rows": rows}


def _stress(metric: Mapping[str, Any]) -> str:
    return f"{1e-6 * metric['value']:.4g} MPa"


def _verdicts(runs: Sequence[ComparedRun]) -> list[list[str]]:
    """Return rows of health, verdict and margin, as far as the runs have them."""
    missed = [
        [name.replace("_", " ") for name, check in run.summary["health"].items() if not check["ok"]] for run in runs
    ]
    rows = [["health", *(f"missed: {', '.join(names)}" if names else "held" for names in missed)]]
    found = [run.summary.get("verdict") for run in runs]
    if any(found):
        rows.append(["verdict on the design", *(NONE if one is None else one["design"] for one in found)])
        margins = [None if one is None else one["joints"][one["joint"]]["margin"] for one in found]
        if any(margin is not None for margin in margins):
            rows.append(["least margin", *(NONE if margin is None else f"{margin:.3g}" for margin in margins)])
    return rows


def _texts(metrics: Sequence[Mapping | None], text: Callable[[Mapping], str]) -> list[str]:
    """Write values; those after the first with their change, where that can be said."""
    first, *others = metrics
    told = [NONE if first is None else text(first)]
    for metric in others:
        change = "" if first is None or metric is None else _change(first["value"], metric["value"])
        told.append(NONE if metric is None else text(metric) + change)
    return told


def _change(first: Any, other: Any) -> str:
    """Write by how much two values differ; nothing where that is little or has no meaning."""
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
