"""Effects of a shock, decided before it runs: state, reason and expected influence."""

from typing import Any

from reflowshock.effect import Decision, Effect, decided
from reflowshock.fem.estimates.drop_effects import DROP_EFFECTS
from reflowshock.workflow.board_drop.board_deflection import DropScene
from reflowshock.workflow.board_drop.fine_joints import CoarseJoints
from reflowshock.workflow.board_drop.identical_joints import IdenticalJoints
from reflowshock.workflow.package.case import BoardDropCase

OF_JOINTS: tuple[Effect[DropScene], ...] = (CoarseJoints(), IdenticalJoints())
SHOCK_EFFECTS: tuple[Effect[DropScene], ...] = (*DROP_EFFECTS, *OF_JOINTS)


def shock_effects(case: BoardDropCase) -> dict[str, Decision]:
    """Decide the effects of a shock."""
    return decided(SHOCK_EFFECTS, DropScene(case))


def of_joint_meshes(case: BoardDropCase) -> dict[str, Decision]:
    """Decide on coarse and identical joints, the effects that add joint meshes."""
    return decided(OF_JOINTS, DropScene(case))


def with_influence(effects: dict, case: BoardDropCase) -> dict[str, Any]:
    """Return the effects of a run with their predicted influence, and the ratio of damping, where there is one."""
    predicted = shock_effects(case)
    by_name: dict[str, Any] = {
        name: predicted.get(f"{name}_in_the_shock", predicted.get(name)) or {} for name in effects
    }
    return {
        name: record | {key: by_name[name][key] for key in ("influence", "ratio") if key in by_name[name]}
        for name, record in effects.items()
    }
