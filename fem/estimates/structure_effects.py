"""Effects of the motion of a structure, for plans and runs; ``STRUCTURE_EFFECTS`` lists them all."""

from collections.abc import Mapping
from dataclasses import dataclass

from reflowshock.effect import Decision, Effect, Toggle, decide_all, decision
from reflowshock.fem.estimates.material_effects import MATERIAL_EFFECTS, MaterialEffect
from reflowshock.fem.problem.kinematics import finite_rotation
from reflowshock.fem.problem.load_kinds import KINDS, Pulsed
from reflowshock.fem.problem.structure import StructureProblem
from reflowshock.materials.parameters import Material


@dataclass(frozen=True, slots=True)
class MotionScene:
    """Motion of a structure, before or after a run.

    Attributes:
        problem: Parameters of the structure and its motion.
        added_mass: Mass added by mass scaling [kg].
        neglected_strain: Largest strain neglected by the kinematics of a run; None before a run.
    """

    problem: StructureProblem
    added_mass: float
    neglected_strain: float | None = None

    @property
    def materials(self) -> Mapping[str, Material]:
        """Materials by layer."""
        return self.problem.layer_materials


class Loading(Effect[MotionScene]):
    """Loads of one kind, a class of ``problem.load_kinds``."""

    def __init__(self, kind: type[Pulsed]) -> None:
        """Name the effect after the kind."""
        self.kind, self.name = kind, kind.effect

    def decide(self, motion: MotionScene) -> Decision:
        """Decide by the loads of the case."""
        names = [f"loads.{name}" for name, load in motion.problem.loads.items() if isinstance(load, self.kind)]
        return decision(bool(names), ", ".join(names) or f"no load of kind {self.kind.model_fields['kind'].default}")


class InitialVelocity(Effect[MotionScene]):
    """Initial velocity of the structure."""

    name = "initial_velocity"

    def decide(self, motion: MotionScene) -> Decision:
        """Decide by the setting of the case."""
        velocity = motion.problem.dynamics.initial_velocity
        return decision(any(velocity), f"dynamics.initial_velocity = {list(velocity)} m/s")


class StructureRotation(Effect[MotionScene]):
    """Finite rotations."""

    name = "finite_rotation"
    toggle = Toggle("dynamics.kinematics", "finite", "small")

    def decide(self, motion: MotionScene) -> Decision:
        """Decide by the kinematics of the case, with the neglected strain as reason."""
        return decision(*finite_rotation("dynamics", motion.problem.dynamics.kinematics, motion.neglected_strain))


class StructureDamping(Effect[MotionScene]):
    """Rayleigh damping."""

    name = "damping"

    def decide(self, motion: MotionScene) -> Decision:
        """Decide by the setting of the case."""
        keys = motion.problem.dynamics.damping.model_dump().items()
        settings = [f"{key} = {value:g}" for key, value in keys if value and key != "frequency"]
        return decision(bool(settings), ", ".join(settings) or "dynamics.damping is zero")


class StructureMassScaling(Effect[MotionScene]):
    """Mass scaling: mass added to small elements for a longer time step."""

    name = "mass_scaling"

    def decide(self, motion: MotionScene) -> Decision:
        """Decide by the added mass."""
        scaled = list(motion.problem.dynamics.numerics.mass_scaled)
        why = f"dynamics.numerics.mass_scaled = {scaled}; adds {motion.added_mass:.3e} kg"
        return decision(motion.added_mass > 0.0, why)


class HourglassStiffness(Effect[MotionScene]):
    """Hourglass stiffness of one-point hexahedra."""

    name = "hourglass_stiffness"

    def decide(self, motion: MotionScene) -> Decision:
        """Decide by the formulation of the elements."""
        formulation = motion.problem.structure.formulation
        return decision(formulation == "one_point", f"structure.formulation = {formulation}")


STRUCTURE_EFFECTS: tuple[Effect[MotionScene] | MaterialEffect, ...] = (
    *MATERIAL_EFFECTS,
    *(Loading(kind) for kind in KINDS),
    InitialVelocity(),
    StructureRotation(),
    StructureDamping(),
    StructureMassScaling(),
    HourglassStiffness(),
)


def effects(problem: StructureProblem, added_mass: float, neglected_strain: float | None = None) -> dict[str, Decision]:
    """Decide on the effects of a structure, before or after a run.

    Args:
        problem: Parameters of the structure and its motion.
        added_mass: Mass added by mass scaling [kg].
        neglected_strain: Largest strain neglected by the kinematics of a run; None before a run.

    Returns:
        Effect name -> whether it is on, the reason as text and, if known, its relative influence on the result.
    """
    return decide_all(STRUCTURE_EFFECTS, MotionScene(problem, added_mass, neglected_strain))
