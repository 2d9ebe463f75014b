"""Effects of plastic materials, for plans and runs."""

from collections.abc import Mapping
from math import log
from typing import Protocol

from reflowshock.effect import Decision, Effect, decision
from reflowshock.materials.parameters import Isotropic, JohnsonCook, Material

RATE_OF_DROPS = 100.0  # strain rate of solder in drops [1/s]; up to 50 in cases/bga_drop


class OfMaterials(Protocol):
    """Scene with materials."""

    @property
    def materials(self) -> Mapping[str, Material]:
        """Materials by part or role."""


class MaterialEffect(Effect[OfMaterials]):
    """Effect of plastic materials."""

    source = "Johnson & Cook 1983"

    def decide(self, scene: OfMaterials) -> Decision:
        """Decide by the plastic laws of the materials; the effect is off if all materials are elastic."""
        laws = plastic_laws(scene.materials)
        return self.of_laws(scene, laws) if laws else decision(False, "all materials are elastic")

    def of_laws(self, scene: OfMaterials, laws: Mapping[str, JohnsonCook]) -> Decision:
        """Decide by the plastic laws of at least one material."""
        raise NotImplementedError

    def report(self, run: OfMaterials) -> Decision:
        """Return the decision for the results of a run, which equals the decision of the plan."""
        return self.decide(run)


class Plasticity(MaterialEffect):
    """Plastic flow with isotropic hardening."""

    name = "plasticity"
    adds = "deps_p = 3/2 dp s / sigma_eq, sigma_eq <= sigma_y(p)"
    number = "sigma_eq / sigma_y"
    threshold = 1.0
    influence = "none below sigma_y; above it not predicted"
    implementation = "reflowshock.fem.forces.force_nonlinear.NonlinearElements"
    switch = "materials.solder = SAC405 …, or a table with or without plasticity"
    source = "von Mises; Johnson & Cook 1983"

    def of_laws(self, scene: OfMaterials, laws: Mapping[str, JohnsonCook]) -> Decision:
        """Return the decision, with the yield stress of each material as reason."""
        return decision(True, "; ".join(yields(name, law) for name, law in laws.items()))


class StrainRate(MaterialEffect):
    """Yield stress that increases with the strain rate."""

    name = "strain_rate"
    adds = "sigma_y times 1 + C ln max(1, p' / p0')"
    number = "C"
    threshold = 0.0
    influence = f"C ln(p' / p0') of the yield stress at p' = {RATE_OF_DROPS:g} 1/s"
    implementation = "reflowshock.materials.plasticity.plastic_increment"
    switch = "materials.*.plasticity.C"

    def of_laws(self, scene: OfMaterials, laws: Mapping[str, JohnsonCook]) -> Decision:
        """Decide by the constant C."""
        raised = max(law.C * log(RATE_OF_DROPS / law.reference_rate) for law in laws.values())
        fast = [
            f"{name}: C = {law.C:g} above {law.reference_rate:g} 1/s at which A and B are measured"
            for name, law in laws.items()
            if law.C > 0.0
        ]
        return decision(bool(fast), "; ".join(fast) or "C = 0: no dependence given", max(raised, 0.0))


class ThermalSoftening(MaterialEffect):
    """Yield stress that decreases with temperature."""

    name = "thermal_softening"
    adds = "sigma_y times 1 - T*^m"
    number = "T*^m"
    threshold = 0.0
    influence = "T*^m of the yield stress"
    implementation = "reflowshock.materials.parameters.JohnsonCook"
    switch = "materials.*.temperature"

    def of_laws(self, scene: OfMaterials, laws: Mapping[str, JohnsonCook]) -> Decision:
        """Decide by the temperature of each material."""
        isotropic = {name: item for name, item in scene.materials.items() if isinstance(item, Isotropic)}
        soft = {name: item.softening for name, item in isotropic.items() if item.softening < 1.0}
        why = "; ".join(f"{name}: yield stress times {factor:.3g}" for name, factor in soft.items())
        why = why or "at the temperature at which A and B are measured"
        return decision(bool(soft), why, 1.0 - min(soft.values(), default=1.0))


OF_YIELD_STRESS: tuple[MaterialEffect, ...] = (StrainRate(), ThermalSoftening())
MATERIAL_EFFECTS: tuple[MaterialEffect, ...] = (Plasticity(), *OF_YIELD_STRESS)


def plastic_laws(materials: Mapping[str, Material]) -> dict[str, JohnsonCook]:
    """Return the Johnson-Cook parameters of the plastic materials by name; empty if all materials are elastic.

    Args:
        materials: Materials by role or part name, which becomes the key of the result.
    """
    return {name: material.plasticity for name, material in materials.items() if material.plasticity is not None}


def yields(name: str, law: JohnsonCook) -> str:
    """Return a sentence on the yield stress and the hardening of a material.

    Args:
        name: Name of the material in the sentence.
        law: Johnson-Cook parameters: yield stress A, hardening B p^n with plastic strain p.
    """
    hardening = f", hardening {1e-6 * law.B:g} MPa p^{law.n:g}" if law.B > 0.0 else ", no hardening"
    return f"{name} yields from {1e-6 * law.A:g} MPa on{hardening}"
