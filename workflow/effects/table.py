"""Table of the effects of a case: state, expected influence, reason, and predicted share of the cost.

The cost of an effect is predicted from the forecast of the case with the effect toggled (``Effect.toggled``), or from
ratios measured by ``benchmarks/effects.py`` (``costs.json``). The ``influence`` of a decision is the expected relative
change of the result.
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
def read_measured_ratios() -> dict[str, float]:
    """Return the cost of each effect per time step, as measured by benchmarks.

    Returns:
        Name of an effect -> processor time per step with the effect over the time without it.
    """
    return {name: item["ratio"] for name, item in json.loads(MEASURED.read_text(encoding="utf-8"))["effects"].items()}


def cost_shares(case: Case, effects: Mapping[str, Any]) -> dict[str, float]:
    """Return the share of each effect in the predicted cost; for inactive effects, the share that it would add.

    Shares are negative if the effect saves time. Effects without predicted or measured cost are omitted.

    Args:
        case: Case, whose cost is predicted.
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.

    Returns:
        Name of an effect -> share of the predicted wall time.
    """
    try:
        seconds = kind_of(case).forecast(case).seconds
    except PulseError:
        return {}  # the report of a run whose pulse table has been removed
    total = sum(seconds.values())
    shares = {}
    for name, decision in effects.items():
        sign = 1.0 if decision["on"] else -1.0
        other = _toggled_seconds(case, name, seconds, decision["on"])
        if other is not None and total > 0.0:
            shares[name] = sign * (1.0 - other / total)
    return shares


def _toggled_seconds(case: Case, name: str, seconds: Mapping[str, float], acts: bool) -> float | None:
    """Return the predicted cost of the case with an effect toggled [s], or None if it cannot be predicted."""
    total, effects = sum(seconds.values()), {effect.name: effect for effect in kind_of(case).effects}
    switched = effects[name].toggled(case, acts) if name in effects else None
    if switched is not None:
        try:
            return sum(kind_of(switched).forecast(switched).seconds.values())
        except CaseError:
            return None  # the case is invalid with the effect toggled
    effect = effect_of(name, reflowed="reflow" in case.pipeline.names)
    if effect is None or effect.name not in read_measured_ratios() or effect.stage not in seconds:
        return None
    ratio = read_measured_ratios()[effect.name]
    return total + seconds[effect.stage] * ((1.0 / ratio if acts else ratio) - 1.0)


HEAD = ("effect", "", "influence", "cost", "why")
CAPTION = (
    "influence: expected change of the result; if off, the error of omitting the effect. cost: share of the predicted"
    " time; if off, the share it would add (negative: it saves time). –: not predicted."
)


def rows(case: Case, effects: Mapping[str, Any]) -> Iterator[tuple[str, bool, str, str, str]]:
    """Yield one row per effect of a case, as text except for the state.

    Args:
        case: Case of the effects.
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.

    Yields:
        Name, whether it is on, influence, cost and reason; "–" without a prediction, costs of inactive effects in
        parentheses.
    """
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
    """Format a share in per cent, which may be negative."""
    if share == 0.0:
        return "0 %"
    if abs(share) < 1e-6:
        return "0.0001 %" if share < 0.0 else "< 0.0001 %"
    return percent(share)


def report_table(case: Case, effects: Mapping[str, Any]) -> dict:
    """Return the report table of the effects of a case: state, influence, predicted cost and reason.

    Args:
        case: Case of the effects.
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.

    Returns:
        Table with ``head`` (column titles), ``rows`` (lists of text, one per effect), ``prose`` (True, since the last
        column is wrapped text) and ``caption``.
    """
    table_rows = [
        [name, "on" if acts else "off", influence, cost, why]
        for name, acts, influence, cost, why in rows(case, effects)
    ]
    return {"head": ["effect", "state", *HEAD[2:]], "rows": table_rows, "prose": True, "caption": CAPTION}
