"""Which kinds of case have a ladder."""

from collections.abc import Callable
from typing import Any

from reflowshock.workflow.board_drop.case import PackageCase
from reflowshock.workflow.case.kind import Case
from reflowshock.workflow.case.problems import CaseError, Problem
from reflowshock.workflow.convergence.packages import package_ladder
from reflowshock.workflow.convergence.series import Ladder
from reflowshock.workflow.convergence.solder import drop_ladder, drops_ladder, joint_ladder, oscillation_ladder
from reflowshock.workflow.convergence.structures import structure_ladder
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase
from reflowshock.workflow.structure.case import StructureCase

LADDERS: dict[str, Callable[[Any], Ladder]] = {
    DropCase.kind: drop_ladder,
    JointCase.kind: joint_ladder,
    DropsCase.kind: drops_ladder,
    OscillationCase.kind: oscillation_ladder,
    StructureCase.kind: structure_ladder,
    PackageCase.kind: package_ladder,
}


def ladder_of(case: Case) -> Ladder:
    """Return the ladder of a case.

    Raises:
        CaseError: its kind has none, or nothing of it could be compared.
    """
    if case.kind not in LADDERS:
        known = "one of " + ", ".join(f"[{kind}]" for kind in LADDERS)
        raise CaseError("case", [Problem(case.kind, "has no ladder of accuracy", None, known)])
    return LADDERS[case.kind](case)
