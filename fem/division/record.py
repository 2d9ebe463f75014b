"""Coupling record of a run: ``coupling`` in ``result.json``."""

from typing import Any

import numpy as np

from reflowshock.fem.division.division import Division
from reflowshock.fem.division.whole import Survey


def coupling_record(division: Division, survey: Survey, cut_nodes: int) -> dict[str, Any]:
    """Return scheme with reason, meso share, interface size, and step levels with their elements and cost."""
    plan = division.plan
    level, steps = division.level, (plan.window / division.counts).tolist()
    cost = np.array([float(survey.cost[level == k].sum()) / step for k, step in enumerate(steps)])
    return {
        "scheme": division.scheme,
        "why": division.why,
        "m": plan.substeps,
        "ratios": list(division.ratios),
        "meso_share": float(division.meso.mean()),
        "cut_nodes": cut_nodes,
        "levels": [
            {"step": step, "elements": int(np.sum(level == k)), "cost_share": float(share)}
            for k, (step, share) in enumerate(zip(steps, cost / cost.sum(), strict=True))
        ],
    }
