"""Tables of a study: ranking of points, main effects of factors, points without a healthy result."""

from collections.abc import Iterable, Sequence

from reflowshock.workflow.case.text import quantity
from reflowshock.workflow.study.main_effects import MainEffect, effect_of, rank_parameters, select_measured
from reflowshock.workflow.study.results import HEALTHY, UNHEALTHY, Row
from reflowshock.workflow.study.study_file import Study

MIXED = "{} of {} points have no result, so means at the values of a factor also differ by the other factors."
UNSOUND = "{} of {} points failed a check; they count in the means."


def ranking(study: Study, rows: Sequence[Row]) -> dict:
    """Return the table of healthy points, the best first; of keys that vary together only the first is listed.

    Args:
        study: Study with its factors, metrics and goal.
        rows: Results of the points.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): rank, point, its
        first keys, and the metrics of the study.
    """
    metrics = study.metrics
    keys = [factor.keys[0] for factor in study.design.factors]
    head = ["rank", "point", *_short(keys), *(name.replace("_", " ") for name in metrics)]
    return {
        "head": head,
        "rows": [
            [
                str(rank),
                row.key,
                *(row.settings[key] for key in keys),
                *(quantity(row.metrics[name]) if name in row.metrics else "–" for name in metrics),
            ]
            for rank, row in enumerate(rank_parameters(rows, study.about.rank_by, study.about.goal), start=1)
        ],
    }


def effects(study: Study, rows: Sequence[Row]) -> list[tuple[str, str, list[MainEffect]]]:
    """Return metric, unit and the main effect of every factor, for each metric that the points have.

    Args:
        study: Study with its factors and metrics.
        rows: Results of the points.

    Returns:
        One item per metric: its name, its SI unit, and the main effect of each factor.
    """
    return [
        (name, numeric[0].metrics[name]["unit"], [effect_of(factor, numeric, name) for factor in study.design.factors])
        for name in study.metrics
        if (numeric := select_measured(rows, name))
    ]


def effect_table(effects: Sequence[tuple[str, str, Sequence[MainEffect]]]) -> dict:
    """Return the table of main effects, for each metric the largest first.

    Args:
        effects: Metric, its unit and its main effects, see ``effects``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): factor, metric,
        size of the effect, rank correlation and p-value.
    """
    return {
        "head": ["factor", "metric", "effect", "rank correlation", "p-value"],
        "rows": [
            [
                effect.factor.keys[0],
                metric.replace("_", " "),
                quantity({"value": effect.size, "unit": unit}),
                "–" if effect.rank_correlation is None else f"{effect.rank_correlation:+.2f}",
                "–" if effect.probability is None else f"{effect.probability:.3g}",
            ]
            for metric, unit, metric_effects in effects
            for effect in sorted(metric_effects, key=lambda effect: -effect.size)
        ],
    }


def imbalance(rows: Sequence[Row]) -> str:
    """Return a warning if points without metrics or with failed checks bias the means of main effects; else empty.

    Args:
        rows: Results of the points.
    """
    missing, unsound = sum(not row.metrics for row in rows), sum(row.verdict == UNHEALTHY for row in rows)
    remarks = [text.format(count, len(rows)) for text, count in ((MIXED, missing), (UNSOUND, unsound)) if count]
    return " ".join(remarks)


def troubles(rows: Sequence[Row]) -> dict:
    """Return the table of failed, impossible and unhealthy points.

    Args:
        rows: Results of the points.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): settings, point,
        result and reason; ``prose`` for wrapped text.
    """
    return {
        "head": ["settings", "point", "result", "reason"],
        "prose": True,
        "rows": [
            [_settings_text(row), row.key or f"number {row.number}", row.verdict, row.message]
            for row in rows
            if row.verdict != HEALTHY
        ],
    }


def _settings_text(row: Row) -> str:
    return ", ".join(f"{name} {value}" for name, value in zip(_short(row.settings), row.settings.values(), strict=True))


def _short(keys: Iterable[str]) -> list[str]:
    """Return the last two names of each dotted key, separated by a space."""
    return [" ".join(key.split(".")[-2:]).replace("_", " ") for key in keys]
