"""accuracy.html, accuracy.png and accuracy.md; the same as a section of the report of a run."""

from pathlib import Path

from reflowshock.workflow import __version__
from reflowshock.workflow.case.case import CASES, Case
from reflowshock.workflow.convergence import tables
from reflowshock.workflow.convergence.calibration import folder_name
from reflowshock.workflow.convergence.measured import FILE, Accuracy, read_accuracy
from reflowshock.workflow.convergence.plot import figure, save_picture
from reflowshock.workflow.report.curves import svg
from reflowshock.workflow.report.template import write_page

PAGE, PICTURE, TEXT = "accuracy.html", "accuracy.png", "accuracy.md"


def write_pages(folder: Path, accuracy: Accuracy, remarks: tuple[str, ...] = ()) -> None:
    """Write page, picture and Markdown table of a measurement.

    Args:
        folder: where they go.
        accuracy: what was measured.
        remarks: what else is told.
    """
    write_page(folder / PAGE, "accuracy.html.j2", {"version": __version__, "accuracy": section(accuracy, remarks)})
    save_picture(accuracy, folder / PICTURE)
    (folder / TEXT).write_text(markdown(accuracy), encoding="utf-8")


def section(accuracy: Accuracy, remarks: tuple[str, ...] = (), elsewhere: bool = False) -> dict:
    """Return what the section of a page tells.

    Args:
        accuracy: what was measured.
        remarks: what else is told.
        elsewhere: whether it was measured of another case than the page is on.
    """
    chosen = accuracy.recommended
    advice = (
        {}
        if chosen is None
        else {
            "chosen": chosen.rung.name,
            "why": chosen.why[0].upper() + chosen.why[1:],
            "advice": "\n".join(tables.as_lines(chosen.rung.settings)),
            "options": tables.as_options(chosen.rung.settings),
        }
    )
    stages = dict.fromkeys(stage for one in accuracy.measurements for stage in one.stages)
    return advice | {
        "case": accuracy.case,
        "command": accuracy.command,
        "machine": str(accuracy.machine),
        "judged": accuracy.errors[accuracy.judged],
        "stages": " and ".join(f"stage {stage}" for stage in stages),
        "plot": svg(figure(accuracy)),
        "legend": tables.legend(accuracy),
        "runs": tables.runs(accuracy),
        "orders": tables.orders(accuracy),
        "prediction": tables.prediction(accuracy),
        "remarks": remarks,
        "elsewhere": elsewhere,
    }


def section_for(run_folder: Path, case: Case) -> dict | None:
    """Return the section of a case's report: what was measured of the case itself, beside its run folder.

    Without that, what a case of the same kind that comes with the program has; None where none does.
    """
    own = read_accuracy(run_folder.resolve().parent / folder_name(case) / FILE)
    if own is not None and own.kind == case.kind:
        return section(own)
    for path in sorted(CASES.glob(f"*/{FILE}")):
        found = read_accuracy(path)
        if found is not None and found.kind == case.kind:
            return section(found, elsewhere=found.case != case.case.name)
    return None


def markdown(accuracy: Accuracy) -> str:
    """Return tables of runs, orders and the recommendation in Markdown."""
    legend = tables.legend(accuracy).replace(tables.ON_FRONT, f"\\{tables.ON_FRONT}")
    blocks = [_markdown(tables.runs(accuracy)), f"{legend}.", _markdown(tables.orders(accuracy))]
    told = tables.prediction(accuracy)
    if told is not None and accuracy.recommended is not None:
        options = tables.as_options(accuracy.recommended.rung.settings)
        blocks += [f"Recommended: `{options}`, {accuracy.recommended.why}.", _markdown(told)]
    return "\n\n".join([*blocks, f"Measured by `{accuracy.command}` on {accuracy.machine}."]) + "\n"


def _markdown(table: dict) -> str:
    rows = [table["head"], ["---"] * len(table["head"]), *table["rows"]]
    return "\n".join("| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in rows)
