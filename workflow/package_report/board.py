"""Report section on the board: watch points, strain gauges, natural modes, response spectrum of the input."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reflowshock.workflow.case.text import number
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.curves import GRAVITY, MILLI, MODE_STYLE, TIME
from reflowshock.workflow.report.fitted import Histories, gauge_curves, gauge_table, in_mm
from reflowshock.workflow.report.spectra import mode_table, spectrum_curves


def add_board(
    shock: Path, case: BoardDropCase, histories: Histories, metrics: Mapping[str, Any], context: dict
) -> None:
    """Add curves and tables of the board to the context of a report: watch points, strain gauges, input, natural modes.

    Args:
        shock: Folder of the shock, which is read.
        case: Case of the run.
        histories: Mode -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity, the
            main mode first.
        metrics: Name -> record with ``value`` (SI) and ``unit``.
        context: Context of the page's template, changed in place: ``curves``, ``tables``, ``board_filter``.
    """
    from reflowshock.fem.loads.shock_pulse import shock_pulse

    main = next(iter(histories))
    lengths = read_json(shock / main / "result.json")["model"].get("gauge_lengths", {})
    context["curves"] |= {
        "watched": watch_curves(case, histories),
        "gauges": gauge_curves(histories, case.gauges, MODE_STYLE),
        "input_spectrum": spectrum_curves({"input": shock_pulse(case.shock).pulse}, float(histories[main]["time"][-1])),
    }
    tables = {"watched": watch_table(case, metrics), "gauges": gauge_table(case.gauges, metrics, lengths)}
    for modes in (path for mode in histories if (path := shock / mode / "modes.json").exists()):
        tables["board_modes"] = mode_table(json.loads(modes.read_text(encoding="utf-8")))
    context["tables"] |= tables
    context["board_filter"] = case.shock.filter.label


def watch_table(case: BoardDropCase, metrics: Mapping[str, Any]) -> dict:
    """Return the table of peaks at the watch points of a drop.

    Args:
        case: Case with the watch points.
        metrics: Name -> record with ``value`` (SI) and ``unit``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per watch point: name, position, peak
        displacement [mm], peak acceleration and peak of opposite sign [G]; an empty dict without watch points.
    """
    rows = []
    for name, point in case.watch.items():
        peaks = [metrics.get(f"{which}_acceleration@{name}") for which in ("peak", "second_peak")]
        deflection = number(metrics[f"peak_displacement@{name}"]["value"] / MILLI)
        accelerations = ["–" if peak is None else number(peak["value"]) for peak in peaks]
        rows.append([name, in_mm(point.at), deflection, *accelerations])
    head = [
        "watch point",
        "x, y, z [mm]",
        "peak displacement [mm]",
        "peak acceleration [G]",
        "peak of opposite sign [G]",
    ]
    return {"head": head, "rows": rows} if rows else {}


def watch_curves(case: BoardDropCase, histories: Histories) -> list[Chart]:
    """Return charts of deflection and acceleration of every watch point.

    Args:
        case: Case with the watch points.
        histories: Mode -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity.

    Returns:
        Interactive charts for the report page.
    """
    from reflowshock.fem.loads.shock_pulse import shock_pulse
    from reflowshock.fem.output.acceleration import drop_accelerations

    if not case.watch:
        return []
    pulse, low_pass = shock_pulse(case.shock).pulse, case.shock.filter
    courses = {mode: drop_accelerations(history, pulse, low_pass, case.watch) for mode, history in histories.items()}
    charts = []
    for name in case.watch:
        deflections = [
            Series(x=history["time"] / MILLI, y=history[f"displacement@{name}"][:, 2] / MILLI, **MODE_STYLE[mode])
            for mode, history in histories.items()
        ]
        accelerations = [
            Series(x=points[name].time / MILLI, y=points[name].filtered / GRAVITY, **MODE_STYLE[mode])
            for mode, points in courses.items()
            if name in points
        ]
        charts.append(Chart(TIME, Axis("deflection [mm]"), deflections, title=name))
        charts += [Chart(TIME, Axis("acceleration [G]"), accelerations, title=name)] if accelerations else []
    return charts
