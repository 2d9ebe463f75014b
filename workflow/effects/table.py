"""The effects of a case as rows of text: state, expected influence, why, and the predicted share of the cost.

Their cost is predicted from forecasts of the case the other way (``Effect.other_way``), or from ratios that
``benchmarks/effects.py`` measured (``costs.json``). The ``influence`` of a decision is the expected relative change of
the result.
"""

import json
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from reflowshock.fem.errors import PulseError
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.text import percent
from reflowshock.workflow.effects.registry import effect_of
from reflowshock.workflow.kinds import kind_of

MEASURED = Path(__file__).with_name("costs.json")  # written by benchmarks/effects.py


@cache
def measured() -> dict[str, float]:
    """Return effect -> processor seconds of a step with it over those of one without."""
    return {name: item["ratio"] for name, item in json.loads(MEASURED.read_text(encoding="utf-8"))["effects"].items()}


def cost_shares(case: Case, effects: Mapping[str, Any]) -> dict[str, float]:
    """Return effect -> its share of the predicted cost; of one that is off, what it would add.

    Negative where the effect saves time. Effects whose cost is neither predicted nor measured are left out.
    """
    try:
        seconds = kind_of(case).forecast(case).seconds
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
    total, own = sum(seconds.values()), {effect.name: effect for effect in kind_of(case).effects}
    switched = own[name].other_way(case, acts) if name in own else None
    if switched is not None:
        try:
            return sum(kind_of(switched).forecast(switched).seconds.values())
        except CaseError:
            return None  # the case could not be run that way
    effect = effect_of(name, reflowed="reflow" in case.pipeline.names)
    if effect is None or effect.name not in measured() or effect.stage not in seconds:
        return None
    ratio = measured()[effect.name]
    return total + seconds[effect.stage] * ((1.0 / ratio if acts else ratio) - 1.0)


HEAD = ("effect", "", "influence", "cost", "why")
CAPTION = (
    "influence: expected change of the result; if off, the error of leaving it out. cost: share of the predicted time;"
    " if off, what it would add (below 0: it saves time). –: not predicted."
)


def rows(case: Case, effects: Mapping[str, Any]) -> Iterator[tuple[str, bool, str, str, str]]:
    """Yield name, whether it is on, influence, cost and why of each effect of a case."""
    shares = cost_shares(case, effects)
    for name, decision in effects.items():
        influence, share = decision.get("influence"), shares.get(name)
        cost = "–" if share is None else per_cent(share)
        yield (
            name.replace("_", " "),
            decision["on"],
            "–" if influence is None else per_cent(influence),
            cost if decision["on"] or share is None else f"({cost})" if cost.startswith("-") else f"(+{cost})",
            decision["why"],
        )


def per_cent(share: float) -> str:
    """Write a share, which may be negative."""
    if share == 0.0:
        return "0 %"
    if abs(share) < 1e-6:
        return "0.0001 %" if share < 0.0 else "< 0.0001 %"
    return percent(share)


def report_table(case: Case, effects: Mapping[str, Any]) -> dict:
    """Which effects were simulated, their expected influence and predicted cost, and why: in prose."""
    shown = [
        [name, "on" if acts else "off", influence, cost, why]
        for name, acts, influence, cost, why in rows(case, effects)
    ]
    return {"head": ["effect", "state", *HEAD[2:]], "rows": shown, "prose": True, "caption": CAPTION}
