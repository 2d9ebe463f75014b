"""Comparison of runs as a page, with their histories in common charts, and as tables in the terminal."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from reflowshock.problem import Problem
from reflowshock.workflow import __version__
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.compare.runs import ComparedRun, joints, parameters, results, select_differing
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import CYCLE
from reflowshock.workflow.report.curves import MEGA, MILLI, TIME
from reflowshock.workflow.report.template import write_page

TEMPLATE = "compare.html.j2"
MARK = b'<meta name="generator" content="reflowshock compare">'
MOST_ROWS = 24  # results in the terminal; the page has all
LINES = ("solid", "dashed", "dotted")


def show(runs: Sequence[ComparedRun], console: Console) -> None:
    """Print the parameters and the most important results in which two or more runs differ, or that all are equal.

    Args:
        runs: Two or more runs; the first one is the reference of the changes.
        console: Console to print to.
    """
    changed, different = parameters(runs), select_differing(results(runs))
    console.print(_table(changed) if changed["rows"] else "all parameters are equal")
    console.print(
        _table(different | {"rows": different["rows"][:MOST_ROWS]}) if different["rows"] else "all results are equal"
    )
    if len(different["rows"]) > MOST_ROWS:
        console.print(f"{len(different['rows']) - MOST_ROWS} more results differ; use --out compare.html for all")


def _table(table: dict) -> Table:
    layout = Table(*table["head"], title_justify="left")
    for column in layout.columns[1:]:
        column.justify = "right"
    for row in table["rows"]:
        layout.add_row(*row)
    return layout


def write(runs: Sequence[ComparedRun], path: Path) -> None:
    """Write the HTML page of a comparison; an existing page of this command is replaced.

    Args:
        runs: Two or more runs.
        path: File to write.

    Raises:
        CaseError: The file exists and was not written by this command, or its folder does not exist.
    """
    if not path.parent.is_dir():
        raise CaseError(str(path), [Problem("", f"cannot be written: the folder {path.parent} does not exist")])
    if path.exists() and (path.is_dir() or MARK not in path.read_bytes()):
        raise CaseError(
            str(path), [Problem("", "exists and was not written by reflowshock compare; choose another --out")]
        )
    context = {
        "version": __version__,
        "names": [run.name for run in runs],
        "titles": [run.case.case.title or run.case.case.name for run in runs],
        "parameters": parameters(runs),
        "answers": results(runs),
        "joints": joints(runs),
        "curves": {"histories": histories(runs)},
    }
    write_page(path, TEMPLATE, context)


def histories(runs: Sequence[ComparedRun]) -> list[Chart]:
    """Return charts of histories that all runs have: board centre, critical joint of the first run, watch points.

    Args:
        runs: Two or more runs; the list is empty unless each of them has a shock.

    Returns:
        Interactive charts for the report page, one curve for each run.
    """
    from reflowshock.fem.output.ranking import PEEL, critical_joint
    from reflowshock.workflow.report.histories import joint_stress

    if not all(len(run.history) for run in runs):
        return []
    charts = []
    if all("board_centre" in run.history for run in runs):
        deflections = [run.history["board_centre"][:, 2] / MILLI for run in runs]
        charts.append(_chart("board centre relative to the table [mm]", runs, deflections))
    if all("peel_board" in run.history for run in runs):
        first = runs[0].history
        joint = str(first["joints"][critical_joint(first)])
        if all(joint in map(str, run.history["joints"]) for run in runs):
            stress = [joint_stress(run.history, joint, PEEL) / MEGA for run in runs]
            charts.append(_chart(f"peel stress of {joint} [MPa]", runs, stress))
    shared = [name for name in runs[0].history if name.startswith("displacement@")]
    for name in (name for name in shared if all(name in run.history for run in runs)):
        axis = int(np.argmax(np.abs(runs[0].history[name]).max(axis=0)))
        label = f"displacement {'xyz'[axis]} of {name.partition('@')[2]} [mm]"
        charts.append(_chart(label, runs, [run.history[name][:, axis] / MILLI for run in runs]))
    return charts


def _chart(label: str, runs: Sequence[ComparedRun], values: Sequence) -> Chart:
    lines = [
        Series(run.name, run.history["time"] / MILLI, y, CYCLE[k % len(CYCLE)], LINES[k // len(CYCLE) % len(LINES)])
        for k, (run, y) in enumerate(zip(runs, values, strict=True))
    ]
    return Chart(TIME, Axis(label), lines)
