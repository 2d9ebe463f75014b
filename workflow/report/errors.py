"""Errors of the headline figures: discretisation, two scales, neglected effects."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from reflowshock.workflow.case.text import percent
from reflowshock.workflow.report.tables import mode_name

NEGLIGIBLE = 0.01  # smallest expected influence of a neglected effect that is reported
NOT_KNOWN = "not known"
UNMEASURED = "reflowshock accuracy measures it"


@dataclass(frozen=True, slots=True)
class Discretisation:
    """Discretisation errors of a run's figures.

    Attributes:
        errors: Relative error of each metric.
        how: Origin of each error, in words.
        unknown: Reason why other errors are unknown, or how to obtain them.
    """

    errors: Mapping[str, float] = field(default_factory=dict)
    how: Mapping[str, str] = field(default_factory=dict)
    unknown: str = UNMEASURED

    def text(self, name: str) -> str:
        """Return the error of a figure, as text."""
        return f"±{percent(self.errors[name])} ({self.how[name]})" if name in self.errors else NOT_KNOWN


def scheme_error(name: str, results: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the difference of a figure between the first mode and one model on the same mesh, as text.

    Args:
        name: Name of the metric.
        results: Mode -> content of its ``result.json`` (``model``, ``metrics``, ``health``, ``timings``, ``coupling``);
            with one mode the error is unknown, or none for a DNS.
    """
    first, *others = results
    if not others:
        return "none: one model" if first == "dns" else NOT_KNOWN
    ours, theirs = (results[mode]["metrics"].get(name, {"value": None})["value"] for mode in (first, others[0]))
    ends = [results[mode]["model"]["window"] * results[mode]["model"]["windows"] for mode in (first, others[0])]
    if ends[1] < (1.0 - 1e-6) * ends[0]:
        return f"not known: the {mode_name(others[0])} ends at {1e3 * ends[1]:.3g} ms"
    if isinstance(ours, str) or isinstance(theirs, str):
        return "none" if ours == theirs else f"{theirs} in the {mode_name(others[0])}"
    return NOT_KNOWN if ours is None or not theirs else percent(abs(ours / theirs - 1.0))


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
