"""compare.html: runs side by side, with their histories in one chart; and the same tables on the terminal."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from reflowshock.problem import Problem
from reflowshock.workflow import __version__
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.compare.runs import ComparedRun, answers, differing, joints, parameters
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import CYCLE
from reflowshock.workflow.report.curves import MEGA, MILLI, TIME
from reflowshock.workflow.report.template import write_page

TEMPLATE = "compare.html.j2"
MARK = b'<meta name="generator" content="reflowshock compare">'
SHOWN = 24  # rows of answers on a terminal; the page has all
LINES = ("solid", "dashed", "dotted")


def show(runs: Sequence[ComparedRun], console: Console) -> None:
    """Print in which parameters and answers runs differ."""
    changed, found = parameters(runs), differing(answers(runs))
    console.print(_table(changed) if changed["rows"] else "all parameters are the same")
    console.print(_table(found | {"rows": found["rows"][:SHOWN]}) if found["rows"] else "all answers are the same")
    if len(found["rows"]) > SHOWN:
        console.print(f"{len(found['rows']) - SHOWN} more answers differ: --out compare.html has all")


def _table(table: dict) -> Table:
    made = Table(*table["head"], title_justify="left")
    for column in made.columns[1:]:
        column.justify = "right"
    for row in table["rows"]:
        made.add_row(*row)
    return made


def write(runs: Sequence[ComparedRun], path: Path) -> None:
    """Write the page.

    Raises:
        CaseError: the file exists and is no page of this command, or its folder does not exist.
    """
    if not path.parent.is_dir():
        raise CaseError(str(path), [Problem("", f"cannot be written: there is no folder {path.parent}")])
    if path.exists() and (path.is_dir() or MARK not in path.read_bytes()):
        raise CaseError(
            str(path), [Problem("", "exists and was not written by reflowshock compare; give another --out")]
        )
    context = {
        "version": __version__,
        "names": [run.name for run in runs],
        "titles": [run.case.case.title or run.case.case.name for run in runs],
        "parameters": parameters(runs),
        "answers": answers(runs),
        "joints": joints(runs),
        "curves": {"histories": histories(runs)},
    }
    write_page(path, TEMPLATE, context)


def histories(runs: Sequence[ComparedRun]) -> list[Chart]:
    """Return the histories that all runs have: the board's centre, the first run's critical joint, watch points."""
    from reflowshock.fem.output.ranking import PEEL, critical_joint
    from reflowshock.workflow.report.histories import joint_stress

    if not all(len(run.history) for run in runs):
        return []
    charts = []
    if all("board_centre" in run.history for run in runs):
        moved = [run.history["board_centre"][:, 2] / MILLI for run in runs]
        charts.append(_chart("board centre, relative to table [mm]", runs, moved))
    if all("peel_board" in run.history for run in runs):
        first = runs[0].history
        joint = str(first["joints"][critical_joint(first)])
        if all(joint in map(str, run.history["joints"]) for run in runs):
            stress = [joint_stress(run.history, joint, PEEL) / MEGA for run in runs]
            charts.append(_chart(f"peel stress of {joint} [MPa]", runs, stress))
    shared = [name for name in runs[0].history if name.startswith("displacement@")]
    for name in (one for one in shared if all(one in run.history for run in runs)):
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
