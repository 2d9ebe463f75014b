"""Errors of the headline figures: discretisation, two scales, neglected effects."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from reflowshock.workflow.case.text import percent
from reflowshock.workflow.process.products import simulated_time
from reflowshock.workflow.report.tables import mode_name

NEGLIGIBLE = 0.01  # smallest expected influence of a neglected effect that is reported
UNMEASURED = "reflowshock accuracy measures it"


@dataclass(frozen=True, slots=True)
class Discretisation:
    """Discretisation errors of a run's figures.

    Attributes:
        errors: Relative error of each metric.
        how: Origin of each error, or why it is unknown, in words.
        unknown: Reason why other errors are unknown, or how to obtain them.
        orders: Observed order of each metric that has one.
        two_scale: Relative error of two scales of each metric that has one.
        two_scale_how: Origin of the errors of two scales, or why they are unknown; empty for one model.
    """

    errors: Mapping[str, float] = field(default_factory=dict)
    how: Mapping[str, str] = field(default_factory=dict)
    unknown: str = UNMEASURED
    orders: Mapping[str, float] = field(default_factory=dict)
    two_scale: Mapping[str, float] = field(default_factory=dict)
    two_scale_how: str = ""

    def text(self, name: str) -> str:
        """Return the error of a figure as text, or why it has none; empty if nothing is known of it."""
        if name in self.errors:
            return f"±{percent(self.errors[name])} ({self.how[name]})"
        return self.how.get(name, "")

    def two_scale_text(self, name: str, results: Mapping[str, Mapping[str, Any]]) -> str:
        """Return the error of two scales of a figure as text: the estimated one, else that of ``scheme_error``.

        Args:
            name: Name of the metric.
            results: ``result.json`` of each mode of a drop, the main mode first.
        """
        return percent(self.two_scale[name]) if name in self.two_scale else scheme_error(name, results)

    def record(self, results: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
        """Return the errors for ``summary.json``, by metric.

        Args:
            results: ``result.json`` of each mode of a drop, the main mode first; empty for other kinds of case.
        """
        return {
            name: {
                "discretisation": self.errors.get(name),
                "order": self.orders.get(name),
                "two_scale": self.two_scale.get(name, scheme_share(name, results)),
                "how": how + self._two_scale_origin(name),
            }
            for name, how in self.how.items()
        }

    def _two_scale_origin(self, name: str) -> str:
        """Return the origin of the error of two scales of a metric, or why that of all metrics is unknown, as text."""
        applies = bool(self.two_scale_how) and (name in self.two_scale or not self.two_scale)
        return f"; two scales: {self.two_scale_how}" if applies else ""


def scheme_share(name: str, results: Mapping[str, Mapping[str, Any]]) -> float | None:
    """Return the relative difference of a metric between a two-scale run and one model on the same mesh (DNS).

    Args:
        name: Name of the metric.
        results: Mode -> content of its ``result.json``, of which ``metrics`` is read; the first mode is compared with
            the second.

    Returns:
        Magnitude of the difference over the value of the DNS; None if only one mode was run, the DNS ended early, a
        value is missing or not a number, or that of the DNS is zero.
    """
    if len(results) < 2 or _ends_early(results):
        return None
    ours, theirs = (result["metrics"].get(name, {"value": None})["value"] for result in list(results.values())[:2])
    is_number = isinstance(ours, int | float) and isinstance(theirs, int | float)
    return abs(ours / theirs - 1.0) if is_number and theirs else None


def _ends_early(results: Mapping[str, Mapping[str, Any]]) -> bool:
    """Return whether the second mode ends before the first one."""
    ends = [simulated_time(result) for result in list(results.values())[:2]]
    return bool(ends[1] < (1.0 - 1e-6) * ends[0])


def scheme_error(name: str, results: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the difference of a figure between the first mode and one model on the same mesh, as text.

    Args:
        name: Name of the metric.
        results: Mode -> content of its ``result.json`` (``model``, ``metrics``, ``health``, ``timings``, ``coupling``);
            the first mode is compared with the second.

    Returns:
        Difference in per cent, or why there is none; "none" for equal texts, such as names of joints; empty if only
        one mode was run, or a value is missing or zero.
    """
    first, *others = results
    if not others:
        return ""
    ours, theirs = (results[mode]["metrics"].get(name, {"value": None})["value"] for mode in (first, others[0]))
    if _ends_early(results):
        return f"the {mode_name(others[0])} ends at {1e3 * simulated_time(results[others[0]]):.3g} ms"
    if isinstance(ours, str) or isinstance(theirs, str):
        return "none" if ours == theirs else f"{theirs} in the {mode_name(others[0])}"
    share = scheme_share(name, results)
    return "" if share is None else percent(share)


def left_out(effects: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the neglected effects with an expected influence of at least 1 %, the largest first, as text.

    Args:
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence`` (relative change of
            the result).

    Returns:
        Names with their influence in per cent, or a sentence that there are none.
    """
    influence = {name: item["influence"] for name, item in effects.items() if not item["on"] and "influence" in item}
    large = sorted(
        (name for name in influence if influence[name] >= NEGLIGIBLE), key=influence.__getitem__, reverse=True
    )
    text = ", ".join(f"{name.replace('_', ' ')} {percent(influence[name])}" for name in large)
    return text or f"none with an expected influence above {percent(NEGLIGIBLE)}"
