"""The board in the report of a drop: watch points, strain gauges, natural modes, response spectrum of the input."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib import pyplot

from reflowshock.workflow.case.text import number
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.report.curves import MILLI, MODE_STYLE, STYLE, svg
from reflowshock.workflow.report.fitted import Histories, gauge_curves, gauge_table, in_mm
from reflowshock.workflow.report.spectra import GRAVITY, mode_table, spectrum_curves


def add_board(
    shock: Path, case: BoardDropCase, histories: Histories, metrics: Mapping[str, Any], context: dict
) -> None:
    """Add what is known of the board.

    Args:
        shock: folder of the shock.
        case: the case.
        histories: of its modes, the one whose figures count first.
        metrics: of the run.
        context: of the page.
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
    """Return the peaks of every watch point; empty without any."""
    rows = []
    for name, point in case.watch.items():
        peaks = [metrics.get(f"{which}_acceleration@{name}") for which in ("peak", "second_peak")]
        deflection = number(metrics[f"peak_displacement@{name}"]["value"] / MILLI)
        shown = ["–" if peak is None else number(peak["value"]) for peak in peaks]
        rows.append([name, in_mm(point.at), deflection, *shown])
    head = ["watch point", "x, y, z [mm]", "peak displacement [mm]", "peak acceleration [G]", "of opposite sign [G]"]
    return {"head": head, "rows": rows} if rows else {}


def watch_curves(case: BoardDropCase, histories: Histories) -> str:
    """Draw deflection and acceleration of every watch point; empty without any."""
    from reflowshock.fem.loads.shock_pulse import shock_pulse
    from reflowshock.fem.output.acceleration import drop_accelerations

    if not case.watch:
        return ""
    pulse, low_pass = shock_pulse(case.shock).pulse, case.shock.filter
    size = (9.2, 2.2 * len(case.watch))
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            len(case.watch), 2, figsize=size, squeeze=False, sharex=True, constrained_layout=True
        )
        for mode, history in histories.items():
            courses = drop_accelerations(history, pulse, low_pass, case.watch)
            for (left, right), name in zip(axes, case.watch, strict=True):
                left.plot(history["time"] / MILLI, history[f"displacement@{name}"][:, 2] / MILLI, **MODE_STYLE[mode])
                left.set_ylabel("deflection [mm]")
                left.set_title(name, loc="left")
                if name in courses:
                    course = courses[name]
                    right.plot(course.time / MILLI, course.filtered / GRAVITY, **MODE_STYLE[mode])
                right.set_ylabel("acceleration [G]")
        axes[0, 0].legend(frameon=False)
        for axis in axes[-1]:
            axis.set_xlabel("time [ms]")
        return svg(figure)
