"""study.html, main_effects.png, process_map.png, results.csv and results.parquet of a study."""

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
    """Write all results of a study.

    Args:
        folder: where they go.
        study: what was varied.
        rows: one a point.
    """
    table = columns(rows, study)
    write_csv(folder / "results.csv", table)
    write_parquet(folder / "results.parquet", table)
    found = tables.effects(study, rows)
    pictures = {"picture": _picture(folder, found), "map": _map(folder, study, rows)}
    write_page(folder / "study.html", "study.html.j2", _context(study, rows, found) | pictures)


def _context(study: Study, rows: Sequence[Row], found: list) -> dict:
    healthy = sum(row.verdict == HEALTHY for row in rows)
    return {
        "version": __version__,
        "study": study.about,
        "fixed": {"head": ["setting of all points", "value"], "rows": [list(item) for item in study.settings.items()]},
        "count": len(rows),
        "healthy": healthy,
        "ranking": tables.ranking(study, rows),
        "effects": tables.effect_table(found),
        "imbalance": tables.imbalance(rows),
        "troubles": tables.troubles(rows),
        "continuous": any(factor.continuous for factor in study.design.factors),
        "rank_by": study.about.rank_by.replace("_", " "),
    }


def _picture(folder: Path, found: list) -> str:
    """Draw main effects into a PNG; return it in base64. Nothing where no point has a metric."""
    return _saved(main_effects(found), folder / "main_effects.png") if found else ""


def _map(folder: Path, study: Study, rows: Sequence[Row]) -> str:
    """Draw a process map where a metric of the study is told in words, as ``_picture``."""
    metric, told = outcomes(study, rows)
    figure = process_map(study, metric, told) if told else None
    return "" if figure is None else _saved(figure, folder / "process_map.png")


def _saved(figure: Figure, path: Path) -> str:
    """Write a figure as PNG, close it and return it in base64."""
    figure.savefig(path, dpi=150)
    pyplot.close(figure)
    return base64.b64encode(path.read_bytes()).decode()


def main_effects(effects: Sequence[tuple[str, str, Sequence[MainEffect]]]) -> Figure:
    """Draw main effects: means at each value of a factor with least and largest, or samples with their trend.

    Args:
        effects: metric, its unit, its effects: a row of panels each.
    """
    columns = max(len(row) for _, _, row in effects)
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            len(effects), columns, squeeze=False, sharey="row", layout="constrained",
            figsize=(max(2.5 * columns, 4.0), 2.5 * len(effects)),
        )  # fmt: skip
        for row, (metric, unit, own) in zip(axes, effects, strict=True):
            factor, shown = readable(unit, max(float(np.abs(effect.metrics).max()) for effect in own))
            row[0].set_ylabel(f"{metric.replace('_', ' ')} [{shown}]" if shown else metric.replace("_", " "))
            for axis, effect in zip(row, own, strict=False):
                (_samples if effect.factor.continuous and effect.is_ordered else _means)(axis, effect, factor)
                axis.set_xlabel(axis_title(effect))
        return figure


def axis_title(effect: MainEffect) -> str:
    """Name a factor in two lines that fit a panel, with the unit that the study gives its values in."""
    table, _, name = effect.factor.keys[0].rpartition(".")
    return f"{table}\n{name} [{spelled(effect.unit)}]" if effect.unit else f"{table}\n{name}"


def _means(axis: Axes, effect: MainEffect, factor: float) -> None:
    levels = effect.levels
    places = np.arange(len(levels))
    mean, low, high = (
        factor * np.array([getattr(level, name) for level in levels]) for name in ("mean", "low", "high")
    )
    at = [[level.value for level in levels].index(_name(value)) for value in effect.values]
    axis.plot(at, factor * effect.metrics, "_", color=GREY, markersize=9, zorder=3)
    axis.errorbar(
        places, mean, [mean - low, high - mean], color=BLUE, marker="o", markersize=4, capsize=3, linewidth=1.4
    )
    axis.set_xticks(places, [level.value for level in levels])
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
