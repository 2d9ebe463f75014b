"""Pages of a convergence study: accuracy.html, the Pareto plot accuracy.png, accuracy.md, and a section of a report."""

from pathlib import Path
from textwrap import fill

from reflowshock.workflow import __version__
from reflowshock.workflow.case.case import CASES, Case
from reflowshock.workflow.convergence import tables
from reflowshock.workflow.convergence.accuracy_file import FILE, Accuracy, Measurement, read_accuracy
from reflowshock.workflow.convergence.discretisation import is_current, read_case_accuracy
from reflowshock.workflow.convergence.tables import all_measurements, compared, front
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import BLACK, GREY, RED
from reflowshock.workflow.report.template import write_page

COLOURS = ("#0b5fa5", "#d1495b", "#2a7d4f", "#7a5ea8", "#e09f3e", "#5f6c7b", "#1b998b", "#8c564b")
MARKERS = "osD^vP*X"
MOST_LABELS = 14  # run names in the plot
WIDTH = 48  # characters in a line of the label of the error axis


PAGE, PICTURE, TEXT = "accuracy.html", "accuracy.png", "accuracy.md"


def write_pages(folder: Path, accuracy: Accuracy, remarks: tuple[str, ...] = ()) -> None:
    """Write page (HTML), plot (PNG) and tables (Markdown) of a convergence study.

    Args:
        folder: Folder to write to.
        accuracy: Convergence study.
        remarks: Further notes, one sentence each.
    """
    write_page(folder / PAGE, "accuracy.html.j2", {"version": __version__, "accuracy": section(accuracy, remarks)})
    save_picture(accuracy, folder / PICTURE)
    (folder / TEXT).write_text(markdown(accuracy), encoding="utf-8")


def section(accuracy: Accuracy, remarks: tuple[str, ...] = (), *, stale: bool = False) -> dict:
    """Return the values of the template's variables for a study's section: tables, charts, texts and flags by name.

    Args:
        accuracy: Convergence study.
        remarks: Further notes, one sentence each.
        stale: Whether the case has changed since the study was run.
    """
    chosen = accuracy.recommended
    advice = (
        {}
        if chosen is None
        else {
            "chosen": chosen.run.name,
            "why": chosen.why[0].upper() + chosen.why[1:],
            "advice": "\n".join(tables.as_lines(chosen.run.settings)),
            "options": tables.as_options(chosen.run.settings),
        }
    )
    stages = dict.fromkeys(stage for measurement in accuracy.measurements for stage in measurement.stages)
    return advice | {
        "case": accuracy.case,
        "command": accuracy.command,
        "machine": str(accuracy.machine),
        "judged": accuracy.errors[accuracy.judged],
        "stages": " and ".join(f"stage {stage}" for stage in stages),
        "plot": charts(accuracy),
        "legend": tables.legend(accuracy),
        "runs": tables.runs(accuracy),
        "orders": tables.orders(accuracy),
        "prediction": tables.prediction(accuracy),
        "remarks": remarks,
        "stale": stale,
    }


def section_for(run_folder: Path, case: Case) -> dict | None:
    """Return the section on accuracy for the report of a run.

    Args:
        run_folder: Run folder; the study of the case is searched next to it.
        case: Case of the run.

    Returns:
        Values of the template's variables by name, for the study of the case next to the run, else for the shipped
        study of the same case; None without either.
    """
    accuracy = read_case_accuracy(run_folder, case)
    if accuracy is not None:
        return section(accuracy, stale=not is_current(accuracy, case))
    accuracy = read_accuracy(CASES / case.case.name / FILE)
    return section(accuracy) if accuracy is not None and accuracy.kind == case.kind else None


def markdown(accuracy: Accuracy) -> str:
    """Return the tables of runs, observed orders and recommendation of a convergence study in Markdown."""
    legend = tables.legend(accuracy).replace(tables.ON_FRONT, f"\\{tables.ON_FRONT}")
    blocks = [_markdown(tables.runs(accuracy)), f"{legend}.", _markdown(tables.orders(accuracy))]
    predicted = tables.prediction(accuracy)
    if predicted is not None and accuracy.recommended is not None:
        options = tables.as_options(accuracy.recommended.run.settings)
        blocks += [f"Recommended: `{options}`, {accuracy.recommended.why}.", _markdown(predicted)]
    return "\n\n".join([*blocks, f"Measured by `{accuracy.command}` on {accuracy.machine}."]) + "\n"


def _markdown(table: dict) -> str:
    rows = [table["head"], ["---"] * len(table["head"]), *table["rows"]]
    return "\n".join("| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in rows)


def charts(accuracy: Accuracy) -> list[Chart]:
    """Return charts of the judged error over wall time and over core-seconds, with run names as labels.

    Args:
        accuracy: Convergence study; failed and reference runs are left out.

    Returns:
        Interactive charts for the report page.
    """
    level = Axis("error [%]", log=True)
    return [
        Chart(Axis(label, log=True), level, _series(accuracy, cost))
        for cost, label in (("seconds", "wall time [s]"), ("core_seconds", "core-seconds"))
    ]


def _series(accuracy: Accuracy, cost: str) -> list[Series]:
    """Return marks coloured by parameter, the Pareto front, the tolerance and the recommended run."""
    measured = sorted(compared(accuracy), key=lambda m: getattr(m, cost))
    costs, errors = [getattr(m, cost) for m in measured], [_error(m, accuracy) for m in measured]
    lines = []
    for number, parameter in enumerate(dict.fromkeys(m.parameter for m in measured)):
        rows = [k for k, m in enumerate(measured) if m.parameter == parameter]
        values = [costs[k] for k in rows], [errors[k] for k in rows]
        names, colour = [measured[k].run for k in rows], COLOURS[number % len(COLOURS)]
        lines.append(Series(parameter, *values, colour, line="none", marks=True, labels=names))
    best = sorted(front(costs, errors), key=lambda k: costs[k])
    lines.append(Series("Pareto front", [costs[k] for k in best], [errors[k] for k in best], BLACK, line="step"))
    if accuracy.tolerance is not None and costs:
        lines.append(Series("tolerance", [costs[0], costs[-1]], 2 * [100.0 * accuracy.tolerance], RED, line="dashed"))
    chosen = accuracy.recommended
    if chosen is not None and chosen.found is not None and accuracy.judged in chosen.found.errors:
        mark = [getattr(chosen.found, cost)], [_error(chosen.found, accuracy)]
        lines.append(Series("recommended", *mark, GREY, line="none", marks=True, labels=[chosen.run.name]))
    return lines


def save_picture(accuracy: Accuracy, path: Path) -> None:
    """Write the Pareto plot of error over cost as PNG.

    Args:
        accuracy: Convergence study.
        path: File to write.
    """
    from reflowshock.workflow.report.drawing import pyplot

    drawing = figure(accuracy)
    drawing.savefig(path, dpi=150)
    pyplot.close(drawing)


def figure(accuracy: Accuracy):
    """Plot the judged error against wall time and core-seconds, both logarithmic.

    Returns:
        Matplotlib figure with marks coloured by parameter, the Pareto front, tolerance, recommendation, and the cost of
        a reference run.
    """
    from reflowshock.workflow.report.drawing import STYLE, plain_ticks, pyplot

    with pyplot.rc_context(STYLE):
        drawing, axes = pyplot.subplots(1, 2, figsize=(9.6, 4.6), sharey=True, constrained_layout=True)
        for axis, cost, label in zip(axes, ("seconds", "core_seconds"), ("wall time [s]", "core-seconds"), strict=True):
            axis.set(xscale="log", yscale="log", xlabel=label)
            _panel(axis, accuracy, cost)
            plain_ticks(axis.xaxis)
        plain_ticks(axes[0].yaxis)
        axes[0].set_ylabel(fill(f"error [%]: {accuracy.errors[accuracy.judged]}", WIDTH))
        hours = axes[1].secondary_xaxis("top", functions=(lambda s: s / 3600.0, lambda h: h * 3600.0))
        hours.set_xlabel("core-hours")
        plain_ticks(hours.xaxis)
        drawing.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    return drawing


def _panel(axis, accuracy: Accuracy, cost: str) -> None:
    measured = compared(accuracy)
    costs, errors = [getattr(m, cost) for m in measured], [_error(m, accuracy) for m in measured]
    for number, parameter in enumerate(dict.fromkeys(m.parameter for m in measured)):
        rows = [k for k, m in enumerate(measured) if m.parameter == parameter]
        style = {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)]}
        axis.plot([costs[k] for k in rows], [errors[k] for k in rows], ls="", ms=5, label=parameter, **style)
    best = front(costs, errors)
    line = {"color": "#333333", "lw": 0.9, "alpha": 0.6, "zorder": 1, "label": "Pareto front"}
    axis.step([costs[k] for k in best], [errors[k] for k in best], where="post", **line)
    for index in best[:MOST_LABELS]:
        position = (costs[index], errors[index])
        axis.annotate(measured[index].run, position, (4, 3), textcoords="offset points", fontsize=6)
    for m in all_measurements(accuracy):
        if m.value is not None and m.stages and not m.errors:  # a reference run, whose error is unknown
            label = f"cost of the finest run, {m.run}"
            axis.axvline(getattr(m, cost), color="#5f6c7b", lw=1.2, ls=":", label=label)
    if accuracy.tolerance is not None:
        axis.axhline(100.0 * accuracy.tolerance, color="#b3261e", lw=0.9, ls="--", label="tolerance")
    chosen = accuracy.recommended
    if chosen is not None and chosen.found is not None and accuracy.judged in chosen.found.errors:
        ring = {"marker": "o", "ms": 12, "mfc": "none", "mec": "#b3261e", "ls": ""}
        axis.plot([getattr(chosen.found, cost)], [_error(chosen.found, accuracy)], label="recommended", **ring)
    axis.margins(x=0.12)


def _error(measurement: Measurement, accuracy: Accuracy) -> float:
    """Return the error of the judged quantity [%]."""
    return 100.0 * measurement.errors[accuracy.judged].value
