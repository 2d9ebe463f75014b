"""Tables of a study: points by rank, factors by size of their effect, points that have no result."""

from collections.abc import Iterable, Sequence

from reflowshock.workflow.case.text import quantity
from reflowshock.workflow.study.main_effects import MainEffect, effect_of, measured, ranked
from reflowshock.workflow.study.results import HEALTHY, UNHEALTHY, Row
from reflowshock.workflow.study.study_file import Study

MIXED = "{} of {} points have no result, so means at the values of a factor also differ by the other factors."
UNSOUND = "{} of {} points failed a check; they count in the means."


def ranking(study: Study, rows: Sequence[Row]) -> dict:
    """Return the table of healthy points, best first; of keys that change together only the first."""
    metrics = study.metrics
    keys = [factor.keys[0] for factor in study.design.factors]
    head = ["rank", "point", *_short(keys), *(name.replace("_", " ") for name in metrics)]
    return {
        "head": head,
        "rows": [
            [
                str(place),
                row.key,
                *(row.settings[key] for key in keys),
                *(quantity(row.metrics[name]) if name in row.metrics else "–" for name in metrics),
            ]
            for place, row in enumerate(ranked(rows, study.about.rank_by, study.about.goal), start=1)
        ],
    }


def effects(study: Study, rows: Sequence[Row]) -> list[tuple[str, str, list[MainEffect]]]:
    """Return metric, unit and effect of every factor, for each metric that points have."""
    return [
        (name, found[0].metrics[name]["unit"], [effect_of(factor, found, name) for factor in study.design.factors])
        for name in study.metrics
        if (found := measured(rows, name))
    ]


def effect_table(found: Sequence[tuple[str, str, Sequence[MainEffect]]]) -> dict:
    """Return the table of factors, for each metric the largest effect first."""
    return {
        "head": ["factor", "metric", "effect", "rank correlation", "chance alone"],
        "rows": [
            [
                effect.factor.keys[0],
                metric.replace("_", " "),
                quantity({"value": effect.size, "unit": unit}),
                "–" if effect.rank_correlation is None else f"{effect.rank_correlation:+.2f}",
                "–" if effect.probability is None else f"{effect.probability:.3g}",
            ]
            for metric, unit, own in found
            for effect in sorted(own, key=lambda effect: -effect.size)
        ],
    }


def imbalance(rows: Sequence[Row]) -> str:
    """Say that means at a factor's values are not of equal points where some have no result, or a bad one."""
    missing, unsound = sum(not row.metrics for row in rows), sum(row.verdict == UNHEALTHY for row in rows)
    remarks = [text.format(count, len(rows)) for text, count in ((MIXED, missing), (UNSOUND, unsound)) if count]
    return " ".join(remarks)


def troubles(rows: Sequence[Row]) -> dict:
    """Return the table of points that failed, cannot be, or broke a check."""
    return {
        "head": ["settings", "point", "result", "why"],
        "prose": True,
        "rows": [
            [_told(row), row.key or f"number {row.number}", row.verdict, row.message]
            for row in rows
            if row.verdict != HEALTHY
        ],
    }


def _told(row: Row) -> str:
    return ", ".join(f"{name} {value}" for name, value in zip(_short(row.settings), row.settings.values(), strict=True))


def _short(keys: Iterable[str]) -> list[str]:
    """Shorten dotted keys to their last two names, in words."""
    return [" ".join(key.split(".")[-2:]).replace("_", " ") for key in keys]
