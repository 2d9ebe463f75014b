"""Main effects: what a metric does with one factor, over all values of the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reflowshock.workflow.study.designs import Factor
from reflowshock.workflow.study.results import Row, numbers


@dataclass(frozen=True, slots=True)
class Level:
    """A metric at one value of a factor.

    Attributes:
        value: of the factor, as the user wrote it.
        mean: of the metric over all points with this value.
        low: its least.
        high: its largest.
    """

    value: str
    mean: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class MainEffect:
    """What a metric does with one factor.

    Attributes:
        factor: what varies.
        unit: of its values; empty where they are no quantities.
        values: (points,) the factor's values, numbers or names.
        metrics: (points,) the metric, in SI.
        rank_correlation: Spearman's, of points: 1 where the metric grows with the factor; None where this has no order.
        probability: that chance alone would make it as large.
    """

    factor: Factor
    unit: str
    values: tuple[float | str, ...]
    metrics: np.ndarray
    rank_correlation: float | None
    probability: float | None

    @property
    def levels(self) -> list[Level]:
        """The metric at each of the factor's values, in their order."""
        distinct = sorted(set(self.values)) if self.is_ordered else list(dict.fromkeys(self.values))
        chosen = [self.metrics[[own == value for own in self.values]] for value in distinct]
        return [
            Level(f"{value:g}" if isinstance(value, float) else value, own.mean(), own.min(), own.max())
            for value, own in zip(distinct, chosen, strict=True)
        ]

    @property
    def is_ordered(self) -> bool:
        """Whether the factor's values are numbers."""
        return all(isinstance(value, float) for value in self.values)

    @property
    def size(self) -> float:
        """How far the means at the factor's values lie apart; of samples of a range how far their linear trend goes."""
        if self.factor.continuous and len(self.values) > 1:
            slope = np.polyfit(np.array(self.values, dtype=float), self.metrics, 1)[0]
            return float(abs(slope) * np.ptp(np.array(self.values, dtype=float)))
        means = [level.mean for level in self.levels]
        return max(means) - min(means)


def measured(rows: Sequence[Row], metric: str) -> list[Row]:
    """Return the rows that have a metric that is a number."""
    return [row for row in rows if is_number(row.metrics.get(metric, {"value": None})["value"])]


def is_number(value: object) -> bool:
    """Whether a metric's value is one that can be ranked."""
    return isinstance(value, float | int) and not isinstance(value, bool) and bool(np.isfinite(value))


def effect_of(factor: Factor, rows: Sequence[Row], metric: str) -> MainEffect:
    """Return what a metric does with a factor.

    Args:
        factor: what varies.
        rows: those that have the metric.
        metric: its name.
    """
    from scipy.stats import spearmanr

    unit, values = numbers([row.settings[factor.keys[0]] for row in rows])
    found = np.array([float(row.metrics[metric]["value"]) for row in rows])
    ordered = all(isinstance(value, float) for value in values)
    correlation = probability = None
    if ordered and len(set(values)) > 1 and np.ptp(found) > 0.0 and len(rows) > 2:
        result = spearmanr(np.array(values, dtype=float), found)
        correlation, probability = float(result.statistic), float(result.pvalue)
    named = tuple(value if isinstance(value, float) else str(value) for value in values)
    return MainEffect(factor, unit, named, found, correlation, probability)


def ranked(rows: Sequence[Row], metric: str, goal: str) -> list[Row]:
    """Return the healthy rows that have a metric, best first."""
    from reflowshock.workflow.study.results import HEALTHY

    found = [row for row in measured(rows, metric) if row.verdict == HEALTHY]
    return sorted(found, key=lambda row: row.metrics[metric]["value"], reverse=goal == "maximise")
