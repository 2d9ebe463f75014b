"""Which effects a run of a structure simulates, and why."""

from collections.abc import Iterator
from typing import Any

from reflowshock.fem.estimates.material_effects import material_effects
from reflowshock.fem.materials.kinematics import finite_rotation
from reflowshock.fem.problem.structure import KINDS, StructureProblem


def effects(problem: StructureProblem, added_mass: float, neglected_strain: float | None = None) -> dict[str, Any]:
    """Return name -> whether it is on, and why.

    Args:
        problem: The structure.
        added_mass: Mass that scaling has added [kg].
        neglected_strain: Largest strain that a run of small kinematics has left out; None before a run.
    """
    rotation = finite_rotation("dynamics", problem.dynamics.kinematics, neglected_strain)
    others = [*_loads(problem), ("finite_rotation", *rotation), *_scheme(problem, added_mass)]
    return material_effects(problem.layer_materials) | {name: {"on": on, "why": why} for name, on, why in others}


def _loads(problem: StructureProblem) -> Iterator[tuple[str, bool, str]]:
    for kind in KINDS:
        names = [f"loads.{name}" for name, load in problem.loads.items() if isinstance(load, kind)]
        yield kind.effect, bool(names), ", ".join(names) or f"no load of kind {kind.model_fields['kind'].default}"
    velocity = problem.dynamics.initial_velocity
    yield "initial_velocity", any(velocity), f"dynamics.initial_velocity = {list(velocity)} m/s"


def _scheme(problem: StructureProblem, added_mass: float) -> Iterator[tuple[str, bool, str]]:
    damping, numerics = problem.dynamics.damping, problem.dynamics.numerics
    given = {name: value for name, value in damping.model_dump().items() if value and name != "frequency"}
    yield "damping", bool(given), ", ".join(f"{name} = {value:g}" for name, value in given.items()) or "none is given"
    scaled = f"dynamics.numerics.mass_scaled = {list(numerics.mass_scaled)}; adds {added_mass:.3e} kg"
    yield "mass_scaling", added_mass > 0.0, scaled
    one_point = problem.structure.formulation == "one_point"
    yield "hourglass_stiffness", one_point, f"structure.formulation = {problem.structure.formulation}"
