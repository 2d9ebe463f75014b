"""Coupling record of a run: ``coupling`` in ``result.json``."""

from typing import Any

import numpy as np

from reflowshock.fem.division.division import Division
from reflowshock.fem.division.whole import Survey


def coupling_record(division: Division, survey: Survey, cut_nodes: int) -> dict[str, Any]:
    """Return the section ``coupling`` of ``result.json``.

    Args:
        division: Models and step levels.
        survey: Properties of the cells, whose costs are summed by level.
        cut_nodes: Number of interface nodes.

    Returns:
        ``scheme``, ``why`` (reason as text), ``m`` (meso steps per window, the time between two exchanges), ``ratios``
        (steps of level k + 1 in one step of level k), ``meso_share`` (share of the cells in the meso model),
        ``cut_nodes``, and ``levels``: a list from the window inwards of dictionaries with ``step`` [s], ``elements``
        (count) and ``cost_share`` (share of the total cost per second).
    """
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
