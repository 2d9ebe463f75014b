"""Verdict on a dropped package: the criterion with the smallest margin decides; pass or fail of each joint; drop life.

The report judges from the stored histories, so that limits and references are inputs of the report alone
(``Stage.without``). No solder of the library has a limit: none of the sources at hand gives one.
"""

from typing import Any

from reflowshock.fem.output.ranking import PEEL, critical_joint
from reflowshock.workflow.verdict.board_deflection import BoardDeflection
from reflowshock.workflow.verdict.criteria import CRITERIA, JOINT_LIMITS
from reflowshock.workflow.verdict.criterion import FAIL, NO_LIMIT, PASS, JudgedDrop, Judgement, worst
from reflowshock.workflow.verdict.joint_limits import life_of


def verdict_of(drop: JudgedDrop) -> dict[str, Any]:
    """Judge a drop by all criteria.

    Args:
        drop: Histories, metrics and limits of a drop that was run.

    Returns:
        Record of the verdict. ``design`` is the verdict on the package ("PASS", "FAIL" or "NO LIMIT") and ``criterion``
        the name of the criterion that decides it, None if none applies. ``criteria`` is the list of
        ``Judgement.record``. ``joints`` has a record for each joint: ``criterion``, ``value``, ``limit``, ``margin``
        and ``verdict`` of the limit with the smallest margin; ``source`` and ``mesh`` where they apply. ``joint`` is
        the joint with the smallest margin, or the critical joint if none has a margin. ``life`` is the record of the
        shortest life of all joints, and is present only with a law of life.
    """
    judgements = [criterion.judge(drop) for criterion in CRITERIA]
    verdicts = {judgement.verdict for judgement in judgements}
    deciding = worst(judgements)
    joints = _joints(drop)
    margins = {name: joint["margin"] for name, joint in joints.items() if joint["margin"] is not None}
    critical = str(drop.history["joints"][critical_joint(drop.history)])
    life = drop.failure.life
    return {
        "design": next((word for word in (FAIL, PASS) if word in verdicts), NO_LIMIT),
        "criterion": None if deciding is None else deciding.name,
        "criteria": [judgement.record for judgement in judgements],
        "joint": min(margins, key=margins.__getitem__, default=critical),
        "joints": joints,
    } | ({} if life is None else {"life": life_of(life, drop.history)})


def verdict_of_structure() -> dict[str, Any]:
    """Return the verdict on a structure, to which no criterion applies: it names no component that could fail.

    Returns:
        ``design`` "NO LIMIT", ``criterion`` None, ``criteria`` with the record that gives the reason, empty ``joints``.
    """
    why = "a structure does not say which component it carries; only the packages of a board drop are judged"
    record = Judgement(BoardDeflection.name, unit="m", why=why).record
    return {"design": NO_LIMIT, "criterion": None, "criteria": [record], "joints": {}}


def _joints(drop: JudgedDrop) -> dict[str, dict[str, Any]]:
    """Return the record of each joint by the limit with the smallest margin."""
    by_limit = [judged for limit in JOINT_LIMITS if (judged := limit.judge_joints(drop))]
    names, peaks = [str(name) for name in drop.history["joints"]], PEEL.peaks(drop.history)
    records = {}
    for column, name in enumerate(names):
        deciding = worst(judgements[column] for judgements in by_limit)
        record = _record(deciding or Judgement(JOINT_LIMITS[0].name, value=float(peaks[column])))
        records[name] = record | ({"mesh": "coarse"} if name in drop.coarse else {})
    return records


def _record(judged: Judgement) -> dict[str, Any]:
    """Return the record of a joint."""
    source = {"source": judged.source} if judged.applies else {}
    values = {name: getattr(judged, name) for name in ("value", "limit", "margin", "verdict")}
    return {"criterion": judged.name, **values, **source}
