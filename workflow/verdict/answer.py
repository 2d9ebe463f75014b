"""Verdict in words: one-line answer, failed joints, table of criteria."""

from collections.abc import Mapping
from typing import Any

from reflowshock.workflow.case.text import number
from reflowshock.workflow.verdict.criteria import BY_NAME, JOINT_LIMITS
from reflowshock.workflow.verdict.criterion import FAIL, margin_text, value_text
from reflowshock.workflow.verdict.joint_limits import MEASURES

NAMED = 12  # failed joints that a sentence names at most
OF_JOINTS = tuple(limit.name for limit in JOINT_LIMITS)
Record = Mapping[str, Any]


def answer(verdict: Record, error: float | None, unknown: str = "") -> str:
    """Return the verdict in one line, with the criterion that decides and its margin.

    Args:
        verdict: Record of ``verdict_of``, with ``criterion``, ``criteria``, ``joint``, ``joints`` and perhaps ``life``.
        error: Relative discretisation error of the value of the joint that is named; None if unknown.
        unknown: Reason why it is unknown.
    """
    joint = verdict["joints"][verdict["joint"]]
    discretisation = f"unknown ({unknown})" if error is None else f"±{100.0 * error:.2g} %"
    life = f"; {in_drops(verdict['life'])}" if "life" in verdict else ""
    deciding = next((record for record in verdict["criteria"] if record["name"] == verdict["criterion"]), None)
    if deciding is None or deciding["name"] in OF_JOINTS:
        text = f"{verdict['joint']}: {against_limit(joint)}, {joint['verdict']}"
    else:
        text = f"{judged_text(deciding)}, {deciding['verdict']}; {verdict['joint']}: {against_limit(joint)}"
    return f"{text}{life}; discretisation {discretisation}"


def judged_text(record: Record) -> str:
    """Format the value of a criterion with its limit, margin and short source.

    Args:
        record: Record of a criterion that applies: ``name``, ``value`` (None: unlimited), ``limit``, ``unit``,
            ``margin`` (or None) and, if it refers to one, ``joint``.
    """
    criterion = BY_NAME[record["name"]]
    label = f", {criterion.label}" if criterion.label else ""
    margin = "" if record["margin"] is None else f" (margin {margin_text(record['margin'])}{label})"
    limit = value_text(record["limit"], record["unit"])[0]
    value = "unlimited" if record["value"] is None else " ".join(value_text(record["value"], record["unit"])).strip()
    joint = f" of {record['joint']}" if "joint" in record else ""
    return f"{criterion.words}{joint} {value} of {limit}{margin}"


def failing(verdict: Record) -> str:
    """Return a sentence on the joints that fail, the smallest margin first; empty if none fails.

    Args:
        verdict: Record of ``verdict_of``; of ``joints`` (name -> record), ``verdict`` and ``margin`` are read.
    """
    joints = verdict["joints"]
    failed = sorted((name for name in joints if joints[name]["verdict"] == FAIL), key=lambda k: joints[k]["margin"])
    if not failed:
        return ""
    more = [f"and {len(failed) - NAMED} more"] if len(failed) > NAMED else []
    count = f"{len(failed)} of {len(joints)} joints in the model {'fails' if len(failed) == 1 else 'fail'}"
    return f"{count}: {', '.join(failed[:NAMED] + more)}."


def against_limit(joint: Record) -> str:
    """Format the value of a joint with its limit and margin.

    Args:
        joint: Record of a joint in ``verdict_of``: ``criterion``, ``value``, ``limit`` and ``margin``; only the value
            is written if the limit is None.
    """
    words, unit = BY_NAME[joint["criterion"]].words, MEASURES[joint["criterion"]].unit
    value = " ".join(value_text(joint["value"], unit))
    if joint["limit"] is None:
        return f"{words} {value}"
    margin = "" if joint["margin"] is None else f" (margin {margin_text(joint['margin'])})"
    return f"{words} {value} of {value_text(joint['limit'], unit)[0]}{margin}"


def in_drops(life: Record) -> str:
    """Format a life with its scatter band, or as unlimited.

    Args:
        life: Record ``life`` of ``verdict_of``: ``joint``, ``measure``, ``drops`` (None: unlimited), ``least``,
            ``most``.
    """
    if life["drops"] is None:
        return f"life unlimited, {life['measure'].replace('_', ' ')} is not positive"
    middle, least, most = (number(float(f"{life[name]:.2g}")) for name in ("drops", "least", "most"))
    return f"life of {life['joint']} {middle} drops ({least} to {most})"


def criteria_table(verdict: Record) -> dict:
    """Return the table of the criteria that apply, the smallest margin first, and a note on the others.

    Args:
        verdict: Record of ``verdict_of``; its ``criteria`` and, if present, ``life`` are read.

    Returns:
        ``head`` (column titles), ``rows`` (texts of value, limit, margin, verdict and source), ``prose`` and ``note``.
    """
    applying = sorted(
        (r for r in verdict["criteria"] if r["applies"]), key=lambda r: (r["margin"] is None, r["margin"])
    )
    rows = [[*_cells(record), record["verdict"], _remark(record)] for record in applying]
    if "life" in verdict and not any(record["name"] == "life" for record in applying):
        rows.append(["life", in_drops(verdict["life"]), "–", "–", "–", f"informative; {verdict['life']['source']}"])
    head = ["criterion", "value", "limit", "margin", "verdict", "source, formula"]
    others: dict[str, list[str]] = {}
    for record in verdict["criteria"]:
        if not record["applies"] and not (record["name"] == "life" and "life" in verdict):
            others.setdefault(record["why"], []).append(BY_NAME[record["name"]].words)
    note = "; ".join(f"{', '.join(names)} ({why})" for why, names in others.items())
    return {"head": head, "rows": rows, "prose": True, "note": f"Not judged: {note}." if note else ""}


def _cells(record: Record) -> list[str]:
    """Return criterion, value, limit and margin as text."""
    value = "unlimited" if record["value"] is None else " ".join(value_text(record["value"], record["unit"])).strip()
    limit = " ".join(value_text(record["limit"], record["unit"])).strip()
    margin = "–" if record["margin"] is None else f"{record['margin']:.3g}"
    words = BY_NAME[record["name"]].words
    return [f"{words} of {record['joint']}" if "joint" in record else words, value, limit, margin]


def _remark(record: Record) -> str:
    """Return source, formula with numbers, and range of validity of a criterion of the program."""
    criterion = BY_NAME[record["name"]]
    built_in = [criterion.formula, f"for {criterion.valid}"] if criterion.label else []
    return ". ".join(text for text in (record["source"], *built_in, record["why"]) if text)
