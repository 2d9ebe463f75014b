"""Main effects: dependence of a metric on one factor, averaged over the others, with Spearman's rank correlation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reflowshock.workflow.study.designs import Factor
from reflowshock.workflow.study.results import Row, numbers


@dataclass(frozen=True, slots=True)
class Level:
    """Metric at one value of a factor.

    Attributes:
        value: Value of the factor as the user wrote it.
        mean: Mean of the metric over all points with this value.
        low: Smallest value of the metric.
        high: Largest value of the metric.
    """

    value: str
    mean: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class MainEffect:
    """Main effect of a factor on a metric.

    Attributes:
        factor: Varied factor.
        unit: Unit of the factor's values; empty if they are not quantities.
        values: Values of the factor, numbers or names, one per point.
        metrics: Values of the metric, shape (points,), in SI units.
        rank_correlation: Spearman's rank correlation, 1 if the metric grows with the factor; None for names.
        probability: Probability of a correlation at least as large by chance (p-value).
    """

    factor: Factor
    unit: str
    values: tuple[float | str, ...]
    metrics: np.ndarray
    rank_correlation: float | None
    probability: float | None

    @property
    def levels(self) -> list[Level]:
        """Metric at each value of the factor, in their order."""
        distinct = sorted(set(self.values)) if self.is_ordered else list(dict.fromkeys(self.values))
        groups = [self.metrics[[other == value for other in self.values]] for value in distinct]
        return [
            Level(f"{value:g}" if isinstance(value, float) else value, group.mean(), group.min(), group.max())
            for value, group in zip(distinct, groups, strict=True)
        ]

    @property
    def is_ordered(self) -> bool:
        """Whether the factor's values are numbers."""
        return all(isinstance(value, float) for value in self.values)

    @property
    def size(self) -> float:
        """Difference between the largest and smallest mean; for samples of a range, the change of the linear trend."""
        if self.factor.continuous and len(self.values) > 1:
            slope = np.polyfit(np.array(self.values, dtype=float), self.metrics, 1)[0]
            return float(abs(slope) * np.ptp(np.array(self.values, dtype=float)))
        means = [level.mean for level in self.levels]
        return max(means) - min(means)


def select_measured(rows: Sequence[Row], metric: str) -> list[Row]:
    """Return the results in which a metric is a finite number, in their order.

    Args:
        rows: Results of the points of a study.
        metric: Name of the metric.
    """
    return [row for row in rows if is_number(row.metrics.get(metric, {"value": None})["value"])]


def is_number(value: object) -> bool:
    """Return whether the value of a metric is a finite number; texts, None and nan are not."""
    return isinstance(value, float | int) and not isinstance(value, bool) and bool(np.isfinite(value))


def effect_of(factor: Factor, rows: Sequence[Row], metric: str) -> MainEffect:
    """Return the main effect of a factor on a metric.

    Args:
        factor: Varied factor.
        rows: Points that have the metric.
        metric: Name of the metric.

    Returns:
        Values of factor and metric, and their rank correlation with its p-value if the factor is a number.
    """
    from scipy.stats import spearmanr

    unit, values = numbers([row.settings[factor.keys[0]] for row in rows])
    metrics = np.array([float(row.metrics[metric]["value"]) for row in rows])
    ordered = all(isinstance(value, float) for value in values)
    correlation = probability = None
    if ordered and len(set(values)) > 1 and np.ptp(metrics) > 0.0 and len(rows) > 2:
        result = spearmanr(np.array(values, dtype=float), metrics)
        correlation, probability = float(result.statistic), float(result.pvalue)
    labels = tuple(value if isinstance(value, float) else str(value) for value in values)
    return MainEffect(factor, unit, labels, metrics, correlation, probability)


def rank_parameters(rows: Sequence[Row], metric: str, goal: str) -> list[Row]:
    """Return the results of healthy points in which a metric is a number, the best first.

    Args:
        rows: Results of the points.
        metric: Name of the metric.
        goal: "minimise" or "maximise"; rows with failed checks are left out.
    """
    from reflowshock.workflow.study.results import HEALTHY

    healthy = [row for row in select_measured(rows, metric) if row.verdict == HEALTHY]
    return sorted(healthy, key=lambda row: row.metrics[metric]["value"], reverse=goal == "maximise")
