"""Errors beside the figures of a run: of its mesh, of two scales against one model, and what is left out."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from reflowshock.workflow.case.text import percent
from reflowshock.workflow.report.tables import mode_name

NEGLIGIBLE = 0.01  # expected influence of what is left out, below which it is not told
NOT_KNOWN = "not known"
UNMEASURED = "reflowshock accuracy measures it"


@dataclass(frozen=True, slots=True)
class Discretisation:
    """Discretisation errors of a run's figures.

    Attributes:
        errors: name of a metric -> error as a share of it.
        how: name of a metric -> from what it follows, in words.
        unknown: why that of any other figure is not known, or what is to be done.
    """

    errors: Mapping[str, float] = field(default_factory=dict)
    how: Mapping[str, str] = field(default_factory=dict)
    unknown: str = UNMEASURED

    def text(self, name: str) -> str:
        """Write the error of a figure."""
        return f"±{percent(self.errors[name])} ({self.how[name]})" if name in self.errors else NOT_KNOWN


def scheme_error(name: str, results: Mapping[str, Mapping[str, Any]]) -> str:
    """Write by how much a figure of the first mode differs from that of one model on the same mesh."""
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
    """Write which effects a run has left out and their expected influence, the largest first; the small ones not."""
    known = {name: found["influence"] for name, found in effects.items() if not found["on"] and "influence" in found}
    large = sorted((name for name in known if known[name] >= NEGLIGIBLE), key=known.__getitem__, reverse=True)
    told = ", ".join(f"{name.replace('_', ' ')} {percent(known[name])}" for name in large)
    return told or f"nothing whose expected influence is above {percent(NEGLIGIBLE)}"
