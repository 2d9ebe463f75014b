"""Ratios of a drop's loads to the loads of a reference design, for the verdict and for comparisons of runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from reflowshock.workflow.verdict.criterion import Criterion, JudgedDrop, Judgement, length_text

RATIOS = {"layer_plastic_work": "plastic work", "peel_stress": "peel stress", "peak_board_strain": "board strain"}
LAYER = "joint_layer"  # thickness of solder that plastic work is averaged over
SAME = 1e-6  # relative difference of equal thicknesses
Metrics = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True, slots=True)
class Ratio:
    """Ratio of a metric to its value in a reference; None with the reason why it is undefined."""

    value: float | None
    why: str = ""


def ratio_of(name: str, metrics: Metrics, reference: Metrics) -> Ratio:
    """Return the ratio of a metric of ``RATIOS`` to its value in a reference.

    Joint metrics belong to the critical joint of each design.

    Args:
        name: Key of ``RATIOS``.
        metrics: Name -> record with ``value`` (SI) and ``unit``, of this run.
        reference: The same of the reference design.

    Returns:
        Ratio; None with the reason if a run lacks the metric, its reference is not positive, or plastic work is
        averaged over different layers.
    """
    for owner, values in (("this run", metrics), ("the reference", reference)):
        if name not in values:
            reason = "whose solder does not yield" if name == "layer_plastic_work" else "which lacks it"
            return Ratio(None, f"{RATIOS[name]} is unknown in {owner}, {reason}")
    layers = [values[LAYER]["value"] for values in (metrics, reference) if LAYER in values]
    if name == "layer_plastic_work" and len(layers) == 2 and abs(layers[0] - layers[1]) > SAME * layers[1]:
        texts = " and ".join(length_text(layer) for layer in layers)
        return Ratio(None, f"plastic work is averaged over different layers of solder, {texts}")
    value, base = metrics[name]["value"], reference[name]["value"]
    if not base > 0.0:
        return Ratio(None, f"{RATIOS[name]} of the reference is not positive")
    return Ratio(float(value / base))


@dataclass(frozen=True)
class ReferenceRatio(Criterion):
    """Ratio of a load to its value in a design that is known to survive.

    Attributes:
        metric: Name of the metric.
    """

    metric: str
    formula: str = "load / load of the reference design <= largest ratio"
    valid: str = "the same kind of package, drop and mesh"

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``summary.json``."""
        return f"reference_{RATIOS[self.metric].replace(' ', '_')}"

    @property
    def words(self) -> str:  # type: ignore[override]
        """Name in reports."""
        return f"{RATIOS[self.metric]} over the reference"

    def judge(self, drop: JudgedDrop) -> Judgement:
        """Judge the ratio to the reference of the case."""
        given = drop.failure.reference
        if given is None or drop.reference is None:
            return Judgement(self.name, why="needs shock.failure.reference.run")
        ratio = ratio_of(self.metric, drop.metrics, drop.reference)
        if ratio.value is None:
            return Judgement(self.name, why=ratio.why)
        source = f"run {Path(given.run).name}" + (f", {given.source}" if given.source else ", taken to survive")
        return Judgement(self.name, source, ratio.value, given.largest_ratio, "", _ends(drop.metrics, drop.reference))


def _ends(metrics: Metrics, reference: Metrics) -> str:
    """Return a remark on different simulated times, which plastic work depends on; empty if they are equal."""
    ends = [values["simulated_time"]["value"] for values in (metrics, reference) if "simulated_time" in values]
    if len(ends) < 2 or abs(ends[0] - ends[1]) <= 0.01 * ends[1]:
        return ""
    return f"the runs end at {1e3 * ends[0]:.3g} ms and, the reference, {1e3 * ends[1]:.3g} ms"
