"""The effects of a board's shock, decided before it runs: what acts, why, and what it is expected to change."""

from collections.abc import Iterator, Mapping

from reflowshock.fem.estimates.effects import damping, effect
from reflowshock.fem.estimates.material_effects import failure_effect, material_effects
from reflowshock.fem.materials.library import SAC405
from reflowshock.workflow.board_drop.board_deflection import (
    expected_deflection,
    kinematics_effect,
    longest_duration,
    weight_effect,
)
from reflowshock.workflow.board_drop.fine_joints import coarse_joints_effect
from reflowshock.workflow.board_drop.identical_joints import identical_joints_effect
from reflowshock.workflow.case.forecast import Toggle, between, changed
from reflowshock.workflow.package.case import BoardDropCase, PackageCase


def shock_effects(case: BoardDropCase) -> dict:
    """Return effect -> {"on", "why"} and, where it is predicted, "influence"."""
    shock = case.shock
    omega = expected_deflection(case).omega
    return (
        weight_effect(case)
        | kinematics_effect(case)
        | {"damping": damping(shock.damping.coefficients, omega, longest_duration(case))}
        | material_effects(case.materials.by_role)
        | failure_effect(shock.failure)
        | coarse_joints_effect(shock.coupling)
        | dict(_method(case))
        | identical_joints_effect(case)
    )


def _method(case: BoardDropCase) -> Iterator[tuple[str, dict]]:
    """Yield what the models leave out or replace."""
    shock, symmetry = case.shock, case.board.symmetry
    coupled = "two_scale" in shock.numerics.modes
    one_way = coupled and shock.coupling.direction == "one_way"
    direction = f"shock.coupling.direction = {shock.coupling.direction}"
    yield "one_way", effect(one_way, direction if coupled else "one model", None if one_way else 0.0)
    scaled = shock.numerics.mass_scaled
    yield "mass_scaling", effect(bool(scaled), f"shock.numerics.mass_scaled = {list(scaled)}")
    yield "large_mass", effect(shock.method == "large_mass", f"shock.method = {shock.method}", 0.0)
    yield "symmetry", effect(symmetry == "quarter", f"board.symmetry = {symmetry}", 0.0)


def with_influence(found: dict, case: BoardDropCase) -> dict:
    """Return the effects of a run with their predicted influence."""
    predicted = shock_effects(case)
    known = {name: predicted.get(f"{name}_in_the_shock", predicted.get(name, {})) for name in found}
    expected = {name: {"influence": item["influence"]} if "influence" in item else {} for name, item in known.items()}
    return {name: record | expected[name] for name, record in found.items()}


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


def toggles(case: PackageCase) -> dict[str, Toggle]:
    """Return the toggles of the effects whose cost the forecast knows."""
    heated = HEATED if case.thermal is not None else {}
    return {**heated, **(DROPPED if isinstance(case, BoardDropCase) else {})}
