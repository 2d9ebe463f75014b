"""What effects cost in a case: differences of forecasts, and measured ratios of steps where forecasts know nothing."""

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from reflowshock.fem.errors import PulseError
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.effects.registry import effect_of
from reflowshock.workflow.kinds import kind_of, stage_seconds

MEASURED = Path(__file__).with_name("costs.json")  # written by benchmarks/effects.py


@cache
def measured() -> dict[str, float]:
    """Return effect -> processor seconds of a step with it over those of one without."""
    return {name: item["ratio"] for name, item in json.loads(MEASURED.read_text(encoding="utf-8"))["effects"].items()}


def cost_shares(case: Case, effects: Mapping[str, Any]) -> dict[str, float]:
    """Return effect -> its share of the predicted cost; of one that is off, what it would add.

    Negative where the effect saves time. Effects whose cost is neither foreseen nor measured are left out.
    """
    try:
        seconds = stage_seconds(case)
    except PulseError:
        return {}  # a report of a run whose table of the pulse is no longer there
    total = sum(seconds.values())
    shares = {}
    for name, decision in effects.items():
        sign = 1.0 if decision["on"] else -1.0
        other = _other_way(case, name, seconds, decision["on"])
        if other is not None and total > 0.0:
            shares[name] = sign * (1.0 - other / total)
    return shares


def _other_way(case: Case, name: str, seconds: Mapping[str, float], acts: bool) -> float | None:
    """Return the predicted cost [s] of the case with an effect the other way; None where nothing tells it."""
    toggles, total = kind_of(case).toggles(case), sum(seconds.values())
    if name in toggles:
        try:
            return sum(stage_seconds(toggles[name](case, acts)).values())
        except CaseError:
            return None  # the case could not be run that way
    effect = effect_of(name, reflowed="reflow" in case.pipeline.names)
    if effect is None or effect.name not in measured() or effect.stage not in seconds:
        return None
    ratio = measured()[effect.name]
    return total + seconds[effect.stage] * ((1.0 / ratio if acts else ratio) - 1.0)
