"""The Pareto plot: error against wall time and core-seconds."""

from pathlib import Path

from workflow.accuracy.measured import Accuracy, Measurement
from workflow.accuracy.tables import compared, on_front
from workflow.report.curves import STYLE, pyplot

COLOURS = ("#0b5fa5", "#d1495b", "#2a7d4f", "#7a5ea8", "#e09f3e", "#5f6c7b", "#1b998b", "#8c564b")
MARKERS = "osD^vP*X"
LABELLED = 14  # runs that are written beside their marks


def save_picture(accuracy: Accuracy, path: Path) -> None:
    """Write the plot as PNG."""
    drawing = figure(accuracy)
    drawing.savefig(path, dpi=150)
    pyplot.close(drawing)


def figure(accuracy: Accuracy):
    """Plot the judged error against wall time and core-seconds, both logarithmic.

    Returns:
        A figure of matplotlib: marks of one colour for each knob, the front as a line, tolerance and recommendation.
    """
    with pyplot.rc_context(STYLE):
        drawing, axes = pyplot.subplots(1, 2, figsize=(9.6, 4.3), sharey=True, constrained_layout=True)
        for axis, cost, label in zip(axes, ("seconds", "core_seconds"), ("wall time [s]", "core-seconds"), strict=True):
            _panel(axis, accuracy, cost)
            axis.set(xscale="log", yscale="log", xlabel=label)
        axes[0].set_ylabel(f"error [%]: {accuracy.errors[accuracy.judged]}")
        hours = axes[1].secondary_xaxis("top", functions=(lambda s: s / 3600.0, lambda h: h * 3600.0))
        hours.set_xlabel("core-hours")
        drawing.legend(
            *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False, fontsize=8
        )
    return drawing


def _panel(axis, accuracy: Accuracy, cost: str) -> None:
    known, best = compared(accuracy), on_front(accuracy)

    def place(runs: list[Measurement]) -> tuple[list[float], list[float]]:
        return [getattr(one, cost) for one in runs], [_error(one, accuracy) for one in runs]

    for number, knob in enumerate(dict.fromkeys(one.knob for one in known)):
        style = {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)]}
        axis.plot(*place([one for one in known if one.knob == knob]), ls="", ms=5, label=knob, **style)
    on_it = sorted((one for one in known if one.rung in best), key=lambda one: getattr(one, cost))
    axis.plot(*place(on_it), color="#333333", lw=0.9, alpha=0.6, zorder=1, label="Pareto front")
    for one in on_it[:LABELLED]:
        axis.annotate(
            one.rung, (getattr(one, cost), _error(one, accuracy)), (4, 3), textcoords="offset points", fontsize=6.5
        )
    if accuracy.tolerance is not None:
        axis.axhline(100.0 * accuracy.tolerance, color="#b3261e", lw=0.9, ls="--", label="tolerance")
    chosen = accuracy.recommended
    if chosen is not None and chosen.found is not None and accuracy.judged in chosen.found.errors:
        ring = {"marker": "o", "ms": 12, "mfc": "none", "mec": "#b3261e", "ls": ""}
        axis.plot(*place([chosen.found]), label="recommended", **ring)


def _error(one: Measurement, accuracy: Accuracy) -> float:
    """Judged error [%]."""
    return 100.0 * one.errors[accuracy.judged].value
