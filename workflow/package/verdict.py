"""Verdict on a dropped package: pass or fail of each joint, margin, and drops to failure.

The report judges the joints from the histories, so that the limits are inputs of the report alone (``Stage.without``).
No solder of the library has a limit: none of the sources at hand gives one.
"""

from collections.abc import Collection

import numpy as np

from reflowshock.fem.output.ranking import PEEL, PLASTIC_WORK, VON_MISES, Arrays, Measure
from reflowshock.fem.problem.failure import Failure, Life
from reflowshock.workflow.case.text import SHOWN, number, quantity

PASS, FAIL, NO_LIMIT = "PASS", "FAIL", "NO LIMIT"
NAMED = 12  # failed joints that a sentence names at most
MEASURES: dict[str, Measure] = {"peel_stress": PEEL, "layer_von_mises": VON_MISES, "layer_plastic_work": PLASTIC_WORK}
WORDS = {"peel_stress": "peel", "layer_von_mises": "von Mises", "layer_plastic_work": "plastic work"}


def verdict_of(failure: Failure, history: Arrays, critical: str, coarse: Collection[str] = ()) -> dict:
    """Judge the joints of a run.

    Args:
        failure: Limits, and the law of life.
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity.
        critical: Joint that is reported if the case sets no limits.
        coarse: Names of joints with the coarse mesh, whose values are approximate.

    Returns:
        Record of the verdict. ``design`` is the verdict on the package and ``joint`` the joint that decides it.
        ``joints`` contains the ``verdict`` of each joint by the ``criterion`` with the smallest ``margin``, which is
        ``limit`` over ``value``; the margin is None without a limit or a positive value. ``life`` is the shortest of
        all joints, and is present only with a law of life.
    """
    names = [str(name) for name in history["joints"]]
    joints = {name: _of_joint(failure, history, column) for column, name in enumerate(names)}
    joints = {name: joint | ({"mesh": "coarse"} if name in coarse else {}) for name, joint in joints.items()}
    margins = {name: joint["margin"] for name, joint in joints.items() if joint["margin"] is not None}
    verdicts = {joint["verdict"] for joint in joints.values()}
    design = next(word for word in (FAIL, PASS, NO_LIMIT) if word in verdicts or word == NO_LIMIT)
    law = {} if failure.life is None else {"life": _life(failure.life, history)}
    return {"design": design, "joint": min(margins, key=margins.__getitem__, default=critical), "joints": joints} | law


def _of_joint(failure: Failure, history: Arrays, column: int) -> dict:
    """Judge the joint in a column of the history by the criterion with the smallest margin."""
    judged = [
        _against(name, float(MEASURES[name].peaks(history)[column]), limit.limit) | {"source": limit.source}
        for name, limit in failure.limits.items()
    ]
    if not judged:
        value = float(MEASURES["peel_stress"].peaks(history)[column])
        return {"criterion": "peel_stress", "value": value, "limit": None, "margin": None, "verdict": NO_LIMIT}
    return min(judged, key=lambda record: float("inf") if record["margin"] is None else record["margin"])


def _against(criterion: str, value: float, limit: float) -> dict:
    """Return the record of a value judged against a limit."""
    margin = limit / value if value > 0.0 else None
    verdict = PASS if value <= limit else FAIL
    return {"criterion": criterion, "value": value, "limit": limit, "margin": margin, "verdict": verdict}


def _life(life: Life, history: Arrays) -> dict:
    """Return the drops to failure of the joint that fails first by the law of life; None if no measure is positive."""
    measure = MEASURES[life.measure]
    peaks = measure.peaks(history)
    column = int(np.argmax(peaks))
    value = float(peaks[column])
    drops, least, most = life.drops(SHOWN[measure.unit][0] * value) if value > 0.0 else (None, None, None)
    record = {"joint": str(history["joints"][column]), "measure": life.measure, "value": value, "source": life.source}
    return record | {"drops": drops, "least": least, "most": most}


def answer(verdict: dict, error: float | None) -> str:
    """Return the verdict in one line.

    Args:
        verdict: Record of ``verdict_of``, of which ``design`` and the deciding joint are written.
        error: Relative discretisation error of the deciding measure; None if unknown.
    """
    joint = verdict["joints"][verdict["joint"]]
    discretisation = "not known, run reflowshock accuracy" if error is None else f"±{100.0 * error:.2g} %"
    life = f"; {in_drops(verdict['life'])}" if "life" in verdict else ""
    return f"{verdict['joint']}: {against_limit(joint)}, {joint['verdict']}{life}; discretisation {discretisation}"


def failing(verdict: dict) -> str:
    """Return a sentence on the joints that fail, the smallest margin first; empty if none fails.

    Args:
        verdict: Record of ``verdict_of``.
    """
    joints = verdict["joints"]
    failed = sorted((name for name in joints if joints[name]["verdict"] == FAIL), key=lambda k: joints[k]["margin"])
    if not failed:
        return ""
    more = [f"and {len(failed) - NAMED} more"] if len(failed) > NAMED else []
    count = f"{len(failed)} of {len(joints)} joints in the model {'fails' if len(failed) == 1 else 'fail'}"
    return f"{count}: {', '.join(failed[:NAMED] + more)}."


def against_limit(joint: dict) -> str:
    """Format the value of a joint with its limit and margin.

    Args:
        joint: Record of a joint in ``verdict_of``; without a limit only the value is written.
    """
    measure = MEASURES[joint["criterion"]]
    value, unit = _text(joint["value"], measure.unit)
    if joint["limit"] is None:
        return f"{WORDS[joint['criterion']]} {value} {unit}"
    margin = "" if joint["margin"] is None else f" (margin {joint['margin']:.2g})"
    return f"{WORDS[joint['criterion']]} {value} {unit} of {_text(joint['limit'], measure.unit)[0]}{margin}"


def in_drops(life: dict) -> str:
    """Format a life with its scatter band, or as unlimited.

    Args:
        life: Record ``life`` of ``verdict_of``.
    """
    if life["drops"] is None:
        return f"life unlimited, {life['measure'].replace('_', ' ')} is not positive"
    middle, least, most = (number(float(f"{life[name]:.2g}")) for name in ("drops", "least", "most"))
    return f"life of {life['joint']} {middle} drops ({least} to {most})"


def _text(value: float, unit: str) -> tuple[str, str]:
    """Return a value with three digits, and its unit."""
    factor, display_unit = SHOWN[unit]
    return f"{factor * value:.3g}", display_unit


def limits_table(failure: Failure) -> dict | None:
    """Return the table of the limits and the law of life with their sources.

    Args:
        failure: Limits of the case.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text); None without limits and without a law of life.
    """
    rows = [
        [name.replace("_", " "), quantity({"value": limit.limit, "unit": MEASURES[name].unit}), limit.source]
        for name, limit in failure.limits.items()
    ]
    if (life := failure.life) is not None:
        law = f"N = {life.constant:.4g} s^-{life.exponent:g}, scatter factor {life.scatter:g}"
        rows.append([f"life by {life.measure.replace('_', ' ')}", law, life.source])
    return {"head": ["limit", "value", "source"], "rows": rows, "prose": True} if rows else None
