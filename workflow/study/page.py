"""Result files of a study: study.html, main_effects.png, process_map.png, results.csv and results.parquet."""

import base64
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reflowshock.workflow import __version__
from reflowshock.workflow.case.text import readable, spelled
from reflowshock.workflow.report.drawing import STYLE, pyplot
from reflowshock.workflow.report.template import write_page
from reflowshock.workflow.study import tables
from reflowshock.workflow.study.main_effects import MainEffect
from reflowshock.workflow.study.process_map import outcomes, process_map
from reflowshock.workflow.study.results import HEALTHY, Row, columns, write_csv, write_parquet
from reflowshock.workflow.study.study_file import Study

BLUE, RED, GREY = "#0b5fa5", "#d1495b", "#9aa5b1"


def write_results(folder: Path, study: Study, rows: Sequence[Row]) -> None:
    """Write all results of a study: page (HTML), tables (CSV, Parquet) and plots.

    Args:
        folder: Folder to write to.
        study: Study.
        rows: Results, one row per point.
    """
    table = columns(rows, study)
    write_csv(folder / "results.csv", table)
    write_parquet(folder / "results.parquet", table)
    effects = tables.effects(study, rows)
    pictures = {"picture": _picture(folder, effects), "map": _map(folder, study, rows)}
    write_page(folder / "study.html", "study.html.j2", _context(study, rows, effects) | pictures)


def _context(study: Study, rows: Sequence[Row], effects: list) -> dict:
    healthy = sum(row.verdict == HEALTHY for row in rows)
    return {
        "version": __version__,
        "study": study.about,
        "fixed": {"head": ["setting of all points", "value"], "rows": [list(item) for item in study.settings.items()]},
        "count": len(rows),
        "healthy": healthy,
        "ranking": tables.ranking(study, rows),
        "effects": tables.effect_table(effects),
        "imbalance": tables.imbalance(rows),
        "troubles": tables.troubles(rows),
        "continuous": any(factor.continuous for factor in study.design.factors),
        "rank_by": study.about.rank_by.replace("_", " "),
    }


def _picture(folder: Path, effects: list) -> str:
    """Write the main effects as PNG and return it in base64; return an empty text without effects."""
    return _saved(main_effects(effects), folder / "main_effects.png") if effects else ""


def _map(folder: Path, study: Study, rows: Sequence[Row]) -> str:
    """Write a process map as PNG and return it in base64, if a metric of the study has texts as values."""
    metric, described = outcomes(study, rows)
    figure = process_map(study, metric, described) if described else None
    return "" if figure is None else _saved(figure, folder / "process_map.png")


def _saved(figure: Figure, path: Path) -> str:
    """Write a figure as PNG, close it and return it in base64."""
    figure.savefig(path, dpi=150)
    pyplot.close(figure)
    return base64.b64encode(path.read_bytes()).decode()


def main_effects(effects: Sequence[tuple[str, str, Sequence[MainEffect]]]) -> Figure:
    """Draw main effects: mean and range at each value of a factor, or samples with their linear trend.

    Args:
        effects: Metric, its unit and its main effects; each item is a row of panels.

    Returns:
        Figure of Matplotlib with one row of panels per metric and one panel per factor.
    """
    columns = max(len(row) for _, _, row in effects)
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            len(effects), columns, squeeze=False, sharey="row", layout="constrained",
            figsize=(max(2.5 * columns, 4.0), 2.5 * len(effects)),
        )  # fmt: skip
        for row, (metric, unit, metric_effects) in zip(axes, effects, strict=True):
            largest = max(float(np.abs(effect.metrics).max()) for effect in metric_effects)
            factor, label = readable(unit, largest)
            row[0].set_ylabel(f"{metric.replace('_', ' ')} [{label}]" if label else metric.replace("_", " "))
            for axis, effect in zip(row, metric_effects, strict=False):
                (_samples if effect.factor.continuous and effect.is_ordered else _means)(axis, effect, factor)
                axis.set_xlabel(axis_title(effect))
        return figure


def axis_title(effect: MainEffect) -> str:
    """Return the title of a chart axis for a varied factor, in two lines: table and key, with the unit of its values.

    Args:
        effect: Main effect of the factor.
    """
    table, _, name = effect.factor.keys[0].rpartition(".")
    return f"{table}\n{name} [{spelled(effect.unit)}]" if effect.unit else f"{table}\n{name}"


def _means(axis: Axes, effect: MainEffect, factor: float) -> None:
    levels = effect.levels
    positions = np.arange(len(levels))
    mean, low, high = (
        factor * np.array([getattr(level, name) for level in levels]) for name in ("mean", "low", "high")
    )
    at = [[level.value for level in levels].index(_name(value)) for value in effect.values]
    axis.plot(at, factor * effect.metrics, "_", color=GREY, markersize=9, zorder=3)
    axis.errorbar(
        positions, mean, [mean - low, high - mean], color=BLUE, marker="o", markersize=4, capsize=3, linewidth=1.4
    )
    axis.set_xticks(positions, [level.value for level in levels])
    axis.margins(x=0.15)


def _samples(axis: Axes, effect: MainEffect, factor: float) -> None:
    values = np.array(effect.values, dtype=float)
    axis.plot(values, factor * effect.metrics, ".", color=BLUE, markersize=6)
    if len(set(effect.values)) > 1:
        ends = np.array([values.min(), values.max()])
        axis.plot(ends, np.polyval(np.polyfit(values, factor * effect.metrics, 1), ends), "-", color=RED, linewidth=1.2)
    if effect.rank_correlation is not None:
        axis.set_title(f"rank correlation {effect.rank_correlation:+.2f}", fontsize=8)


def _name(value: float | str) -> str:
    return f"{value:g}" if isinstance(value, float) else value
