"""The same case with one effect the other way: what the effect costs is the difference between two forecasts."""

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel

from reflowshock.fem.materials.library import SAC405
from reflowshock.workflow.board_drop.case import BoardDropCase, PackageCase
from reflowshock.workflow.case.kind import Case
from reflowshock.workflow.structure.case import StructureCase

Toggle = Callable[
    [Any, bool], Any
]  # a case and whether the effect acts in it, to the case in which it does not, or does


def changed(model: BaseModel, key: str, value: object) -> Any:
    """Return a model with another value at a dotted key; nothing is checked."""
    name, _, rest = key.partition(".")
    return model.model_copy(update={name: changed(getattr(model, name), rest, value) if rest else value})


def between(key: str, on: object, off: object) -> Toggle:
    """Return the toggle of an effect that a key switches."""
    return lambda case, acts: changed(case, key, off if acts else on)


def _without_yielding(case: BoardDropCase, acts: bool) -> BoardDropCase:
    """Return the case with elastic materials, or with solder that yields."""
    if not acts:
        return changed(case, "materials.solder", SAC405)
    roles = {role: material for role, material in case.materials.by_role.items() if material.plasticity is not None}
    elastic = {role: material.model_copy(update={"plasticity": None}) for role, material in roles.items()}
    return case.model_copy(update={"materials": case.materials.model_copy(update=elastic)})


HEATED: Mapping[str, Toggle] = {
    "solder_force": between("thermal.effects.solder_force", "on", "off"),
    "residual_stress": between("thermal.effects.residual_stress", "on", "off"),
}
DROPPED: Mapping[str, Toggle] = {
    "finite_rotation": between("shock.numerics.kinematics", "finite", "small"),
    "plasticity": _without_yielding,
    "coarse_joints": between("shock.coupling.fine_joints", "critical", "all"),
    "one_way": between("shock.coupling.direction", "one_way", "two_way"),
    "identical_joints": between("shock.identical_joints", True, False),
    "mass_scaling": between("shock.numerics.mass_scaled", ("copper",), ()),
}
OF_STRUCTURES: Mapping[str, Toggle] = {"finite_rotation": between("dynamics.kinematics", "finite", "small")}


def switches(case: Case) -> dict[str, Toggle]:
    """Return the toggles of the effects of a case whose forecast knows what they cost."""
    if isinstance(case, StructureCase):
        return dict(OF_STRUCTURES)
    heated = HEATED if isinstance(case, PackageCase) and case.thermal is not None else {}
    return dict(heated) | (dict(DROPPED) if isinstance(case, BoardDropCase) else {})
