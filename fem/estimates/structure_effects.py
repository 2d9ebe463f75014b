"""The effects of a structure's motion, before a run and after it."""

from collections.abc import Mapping
from dataclasses import dataclass

from reflowshock.effect import Decision, Effect, Toggle, decided, decision
from reflowshock.fem.estimates.material_effects import MATERIAL_EFFECTS, MaterialEffect
from reflowshock.fem.problem.kinematics import finite_rotation
from reflowshock.fem.problem.structure import KINDS, Pulsed, StructureProblem
from reflowshock.materials.parameters import Material


@dataclass(frozen=True, slots=True)
class MotionScene:
    """The motion of a structure.

    Attributes:
        problem: Its parameters.
        added_mass: Mass that scaling adds [kg].
        neglected_strain: Largest strain that a run of small kinematics has left out; None before a run.
    """

    problem: StructureProblem
    added_mass: float
    neglected_strain: float | None = None

    @property
    def materials(self) -> Mapping[str, Material]:
        """Layer -> its material."""
        return self.problem.layer_materials


class Loading(Effect[MotionScene]):
    """Loads of one kind."""

    def __init__(self, kind: type[Pulsed]) -> None:
        """Take the name from the kind."""
        self.kind, self.name = kind, kind.effect

    def decide(self, motion: MotionScene) -> Decision:
        """By the loads of the case."""
        names = [f"loads.{name}" for name, load in motion.problem.loads.items() if isinstance(load, self.kind)]
        return decision(bool(names), ", ".join(names) or f"no load of kind {self.kind.model_fields['kind'].default}")


class InitialVelocity(Effect[MotionScene]):
    """A velocity at the start."""

    name = "initial_velocity"

    def decide(self, motion: MotionScene) -> Decision:
        """As the case says."""
        velocity = motion.problem.dynamics.initial_velocity
        return decision(any(velocity), f"dynamics.initial_velocity = {list(velocity)} m/s")


class StructureRotation(Effect[MotionScene]):
    """Rotations that are finite."""

    name = "finite_rotation"
    toggle = Toggle("dynamics.kinematics", "finite", "small")

    def decide(self, motion: MotionScene) -> Decision:
        """As the case says, with the strain that was left out."""
        return decision(*finite_rotation("dynamics", motion.problem.dynamics.kinematics, motion.neglected_strain))


class StructureDamping(Effect[MotionScene]):
    """Rayleigh damping."""

    name = "damping"

    def decide(self, motion: MotionScene) -> Decision:
        """As the case says."""
        keys = motion.problem.dynamics.damping.model_dump().items()
        given = [f"{key} = {value:g}" for key, value in keys if value and key != "frequency"]
        return decision(bool(given), ", ".join(given) or "none is given")


class StructureMassScaling(Effect[MotionScene]):
    """Mass added to small elements, for longer steps."""

    name = "mass_scaling"

    def decide(self, motion: MotionScene) -> Decision:
        """By the mass that it adds."""
        scaled = list(motion.problem.dynamics.numerics.mass_scaled)
        why = f"dynamics.numerics.mass_scaled = {scaled}; adds {motion.added_mass:.3e} kg"
        return decision(motion.added_mass > 0.0, why)


class HourglassStiffness(Effect[MotionScene]):
    """Stiffness of the modes that one integration point misses."""

    name = "hourglass_stiffness"

    def decide(self, motion: MotionScene) -> Decision:
        """By the formulation."""
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
    """Decide the effects of a structure, see ``MotionScene``."""
    return decided(STRUCTURE_EFFECTS, MotionScene(problem, added_mass, neglected_strain))
