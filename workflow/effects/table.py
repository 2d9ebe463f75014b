"""The effects of a scene as rows of text: state, expected influence on the answer, share of the cost, why."""

from collections.abc import Iterator, Mapping
from typing import Any

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.effects.costs import cost_shares

HEAD = ("effect", "", "influence", "cost", "why")
CAPTION = (
    "influence: expected change of the answer; where off, what is left out. cost: share of the predicted time; where"
    " off, what it would add (below 0: it saves time). –: nothing foresees it."
)


def rows(case: Case, effects: Mapping[str, Any]) -> Iterator[tuple[str, bool, str, str, str]]:
    """Yield name, whether it is on, influence, cost and why of each effect of a scene."""
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
    """Write a share with two digits; nothing smaller than is worth telling."""
    if share == 0.0:
        return "0 %"
    if abs(share) < 1e-6:
        return "0.0001 %" if share < 0.0 else "< 0.0001 %"
    digits = f"{100.0 * share:.2g}"
    return f"{float(digits):.0f} %" if abs(share) >= 0.1 else f"{digits} %"


def report_table(case: Case, effects: Mapping[str, Any]) -> dict:
    """Which effects were simulated, their expected influence and predicted cost, and why: in prose."""
    told = [
        [name, "on" if acts else "off", influence, cost, why]
        for name, acts, influence, cost, why in rows(case, effects)
    ]
    return {"head": ["effect", "state", *HEAD[2:]], "rows": told, "prose": True, "caption": CAPTION}
