"""Effects of a shock, decided before it runs: state, reason and expected influence."""

from typing import Any

from reflowshock.effect import Decision, Effect, decide_all
from reflowshock.fem.estimates.drop_effects import DROP_EFFECTS
from reflowshock.workflow.board_drop.board_deflection import DropScene
from reflowshock.workflow.board_drop.fine_joints import CoarseJoints
from reflowshock.workflow.board_drop.identical_joints import IdenticalJoints
from reflowshock.workflow.package.case import BoardDropCase

OF_JOINTS: tuple[Effect[DropScene], ...] = (CoarseJoints(), IdenticalJoints())
SHOCK_EFFECTS: tuple[Effect[DropScene], ...] = (*DROP_EFFECTS, *OF_JOINTS)


def shock_effects(case: BoardDropCase) -> dict[str, Decision]:
    """Return the decision on each effect of a shock by name: ``on``, ``why`` and, if predicted, ``influence``."""
    return decide_all(SHOCK_EFFECTS, DropScene(case))


def of_joint_meshes(case: BoardDropCase) -> dict[str, Decision]:
    """Decide on coarse and identical joints, the effects that add joint meshes.

    Returns:
        Name of an effect -> its decision (``on``, ``why``).
    """
    return decide_all(OF_JOINTS, DropScene(case))


def with_influence(effects: dict, case: BoardDropCase) -> dict[str, Any]:
    """Return the effects of a run with their predicted influence and the ratio of damping, where they are known.

    Args:
        effects: Name of an effect -> its record in a run (``on``, ``why``); not changed.
        case: Case of the run.

    Returns:
        Records by name, with ``influence``, the expected relative change of the result, where it is predicted, and
            ``ratio`` of critical damping.
    """
    predicted = shock_effects(case)
    by_name: dict[str, Any] = {
        name: predicted.get(f"{name}_in_the_shock", predicted.get(name)) or {} for name in effects
    }
    return {
        name: record | {key: by_name[name][key] for key in ("influence", "ratio") if key in by_name[name]}
        for name, record in effects.items()
    }
