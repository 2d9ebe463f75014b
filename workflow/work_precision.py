"""Error against cost of the sessile drop, as benchmarks/reflow_accuracy.py measured it: table and plot.

One place for the README of the case, the report and the benchmark.
"""

import json
from pathlib import Path

from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workflow.case_text import CASES
from workflow.report.curves import STYLE
from workflow.report.tables import number, percent

STORED = CASES / "sessile_drop" / "work_precision.json"
PICTURE, README = STORED.with_suffix(".png"), STORED.with_name("README.md")
BEGIN, END = "<!-- work-precision: written by benchmarks/reflow_accuracy.py -->", "<!-- work-precision: end -->"

HEAD = ["drop", "scheme, mode, basis", "time step", "height error", "width error", "steps", "seconds", "end"]
MARKERS = {"spacing": "o", "time step": "s", "basis": "D", "mode": "^", "scheme": "v"}
COLOURS = {60: "#0b5fa5", 120: "#d1495b"}
ERRORS = {"height_error": "height", "max_width_error": "width"}


def stored() -> dict | None:
    """The stored measurement, if there is one."""
    return json.loads(STORED.read_text()) if STORED.exists() else None


def table(result: dict) -> dict:
    """Head and rows of text; a run that failed is a row as well."""
    return {"head": HEAD, "rows": [_row(row) for row in result["rows"]]}


def _row(row: dict) -> list[str]:
    errors = [percent(row[name]) if name in row else "" for name in ERRORS]
    seconds = f"{row['seconds']:.1f}" if "seconds" in row else ""
    return [
        f"{row['contact_angle']:g} deg, {row['per_edge']} per edge",
        _method(row),
        f"{row['time_step_limit']:g} x",
        *errors,
        number(row["steps"]),
        seconds,
        row["end"],
    ]


def _method(row: dict) -> str:
    """How the drop was solved; only the seed's scheme has a basis."""
    parts = ("scheme", "mode", "basis") if row["scheme"] == "gripc" else ("scheme", "mode")
    return ", ".join(row[part] for part in parts)


def markdown(result: dict) -> str:
    """Table, observed orders and where they were measured, for the README."""
    rows: list[list[str]] = table(result)["rows"]
    lines = ["| " + " | ".join(cells) + " |" for cells in (HEAD, ["---"] * len(HEAD), *rows)]
    orders = [
        f"{order:.2f} in {ERRORS[name]} at {angle}"
        for name, by_angle in result["orders"].items()
        for angle, order in by_angle.items()
    ]
    return "\n".join(lines) + f"\n\nOrders of the errors in the spacing: {', '.join(orders) or 'not measured'}."


def publish(result: dict) -> None:
    """Store a measurement where the README of the case and the report show it."""
    STORED.write_text(json.dumps(result, indent=1) + "\n")
    save_picture(result, PICTURE)
    before, rest = README.read_text().split(BEGIN)
    README.write_text(f"{before}{BEGIN}\n{markdown(result)}\n{END}{rest.split(END)[1]}")


def save_picture(result: dict, path: Path) -> None:
    """Write the plot as PNG."""
    drawing = figure(result)
    drawing.savefig(path, dpi=150)
    pyplot.close(drawing)


def figure(result: dict) -> Figure:
    """Plot error of height and width against seconds, both logarithmic: a line for the spacing, marks for choices."""
    with pyplot.rc_context(STYLE):
        drawing, axes = pyplot.subplots(1, 2, figsize=(9.2, 3.9), sharex=True, constrained_layout=True)
        for axis, name in zip(axes, ERRORS, strict=True):
            _panel(axis, result["rows"], name)
        axes[0].legend(frameon=False, fontsize=7)
    return drawing


def _panel(axis: Axes, rows: list[dict], name: str) -> None:
    for angle, colour in COLOURS.items():
        for vary, marker in MARKERS.items():
            chosen = [row for row in rows if (row["contact_angle"], row["vary"]) == (angle, vary) and name in row]
            seconds = [row["seconds"] for row in chosen]
            errors = [100.0 * abs(row[name]) for row in chosen]
            line = "-" if vary == "spacing" else ""
            label = f"{angle} deg, other {vary}" if vary != "spacing" else f"{angle} deg, finer spacing"
            if chosen:
                axis.plot(seconds, errors, marker, ls=line, color=colour, ms=5, lw=1.2, label=label)
    failed = [row["seconds"] for row in rows if name not in row and "seconds" in row]
    if failed:
        axis.plot(
            failed, [0.97] * len(failed), "x", color="#444444", transform=axis.get_xaxis_transform(), label="failed"
        )
    axis.set(xscale="log", yscale="log", xlabel="processor seconds", ylabel=f"error of the {ERRORS[name]} [%]")
