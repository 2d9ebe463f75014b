"""Registry of the effects of a reflow and their decisions; loads no numerical library.

To add an effect, write a ``LiquidEffect`` in a file of its own and list it in ``LIQUID_EFFECTS``; its keys are in
``solder.py``.
"""

from collections.abc import Iterator, Mapping

from reflowshock.effect import Decision, decided
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.effect_gravity import GravityEffect
from reflowshock.particles.parameters.effect_inertia import InertiaEffect
from reflowshock.particles.parameters.effect_surface_tension import SurfaceTensionEffect
from reflowshock.particles.parameters.effect_viscosity import ViscosityEffect
from reflowshock.particles.parameters.effect_wall_adhesion import WallAdhesionEffect
from reflowshock.particles.parameters.liquid_effect import (
    LiquidEffect,
    LiquidScene,
    Numbers,
    dimensionless_numbers,
    drop_numbers,
)
from reflowshock.particles.parameters.solder import Solder

<<<<<<< HEAD
=======
# The height of a drop changes by 0.08, 0.13, 0.19 Bo at contact angles of 60, 120, 148 deg (Bashforth-Adams table);
# effects that change the shape by less than 0.1 % are neglected.
SHAPE_CHANGE_BY_BOND = 0.2
NEGLIGIBLE_SHAPE_CHANGE = 1e-3
# Ratio of process time to slowest time above which a motion has decayed.
PROCESS_TIME_RATIO = 20.0
# Largest Bond number at which surface tension determines the shape.
LARGEST_BOND = 100.0


@dataclass(frozen=True, slots=True)
class Numbers:
    """Dimensionless numbers and times of a joint or drop.

    Attributes:
        bond: rho g L H / gamma, weight over surface tension.
        ohnesorge: mu / sqrt(rho gamma L).
        capillary_time: sqrt(rho L^3 / gamma) [s].
        viscous_time: rho L^2 / (5 mu) [s], in which the slowest oscillation decays (Lamb 1932, mode 2).
    """

    bond: float
    ohnesorge: float
    capillary_time: float
    viscous_time: float


def dimensionless_numbers(geometry: JointGeometry, solder: Solder) -> Numbers:
    """Compute the numbers of a joint; H is the gap and L the radius of a cylinder of equal volume and height H."""
    length = sqrt(solder.volume / (pi * geometry.gap))
    return _numbers(solder, length, length * geometry.gap)


def drop_numbers(solder: Solder) -> Numbers:
    """Compute the numbers of a drop: Bond number from V^(1/3), others from the radius of a sphere of equal volume."""
    return _numbers(solder, (0.75 * solder.volume / pi) ** (1.0 / 3.0), solder.volume ** (2.0 / 3.0))


def _numbers(solder: Solder, length: float, area: float) -> Numbers:
    """Compute the numbers from the length of the time scales [m] and the area of the Bond number [m^2]."""
    density, tension = solder.density, solder.surface_tension
    return Numbers(
        bond=density * solder.gravity * area / tension,
        ohnesorge=solder.viscosity / sqrt(density * tension * length),
        capillary_time=sqrt(density * length**3 / tension),
        viscous_time=density * length**2 / (5.0 * solder.viscosity),
    )


@dataclass(frozen=True, slots=True)
class LiquidScene:
    """Liquid solder in a scene.

    Attributes:
        numbers: Dimensionless numbers.
        solder: Properties and process.
        has_wall: Whether the solder touches a wall.
        swings: Whether the solder is an oscillating drop.
    """

    numbers: Numbers
    solder: Solder
    has_wall: bool = True
    swings: bool = False

    @property
    def rival(self) -> float:
        """Bond number of the weight that competes with surface tension; 0 for a free drop or without gravity."""
        return self.numbers.bond if self.has_wall and self.solder.effects.gravity != "off" else 0.0

    @property
    def shaped(self) -> float:
        """Fraction of the shape determined by surface tension: capillary length over size, 1 / sqrt(1 + Bo)."""
        return 1.0 / sqrt(1.0 + self.rival)

    @property
    def slowest_time(self) -> float:
        """Time in which the slowest motion decays [s]."""
        return max(self.numbers.capillary_time, self.numbers.viscous_time)

    @property
    def is_transient(self) -> bool:
        """Whether the process ends before the motion has decayed."""
        return self.solder.process_time / self.slowest_time < PROCESS_TIME_RATIO


class LiquidEffect(Effect[LiquidScene]):
    """Effect of a reflow: ``implementation`` names its ``Acting`` class, and ``SolderEffects`` holds its switch.

    Attributes:
        of_motion: Whether the effect vanishes at rest.
        is_measured: Whether ``benchmarks/effects.py`` measures the cost of the effect per step.
    """

    stage = "reflow"
    of_motion = False
    is_measured = False

    @abstractmethod
    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide by the dimensionless numbers alone."""

    def decide(self, liquid: LiquidScene) -> Decision:
        """Decide by the user's switch, otherwise by the dimensionless numbers."""
        auto, switch = self.auto(liquid), getattr(liquid.solder.effects, self.name)
        if switch == "auto":
            return auto
        return auto | decision(switch == "on", f"set to {switch} by the user ({auto['why']})")


class GravityEffect(LiquidEffect):
    """Gravity, which flattens bodies on a wall."""

    name = "gravity"
    adds = "f = -rho g z dV/dx on the free surface"
    number = f"{SHAPE_CHANGE_BY_BOND:g} Bo, Bo = rho g L H / gamma"
    threshold = NEGLIGIBLE_SHAPE_CHANGE
    influence = f"{SHAPE_CHANGE_BY_BOND:g} Bo of the shape, up to (large contact angles)"
    implementation = "reflowshock.particles.physics.forces.Gravity"
    switch = "solder.effects.gravity (of a scene: gravity) = auto, on, off"
    source = "Bashforth & Adams 1883, heights of sessile drops"
    is_measured = True

    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide by the relative change of the height."""
        change = SHAPE_CHANGE_BY_BOND * liquid.numbers.bond
        why = f"Bond number {liquid.numbers.bond:.3g}: changes the shape by about {100 * change:.3g} %"
        return decision(change > NEGLIGIBLE_SHAPE_CHANGE, why, min(change, 1.0))

    def decide(self, liquid: LiquidScene) -> Decision:
        """Return off without a wall, regardless of the switch."""
        if not liquid.has_wall:
            return decision(False, "no wall: the drop falls as a whole, which does not change its shape")
        return super().decide(liquid)


class MotionEffect(LiquidEffect):
    """Effect of the motion, which matters in short processes."""

    threshold = PROCESS_TIME_RATIO
    acts = "below"
    of_motion = True
    is_measured = True

    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide by the ratio of process time to slowest time."""
        ratio = liquid.solder.process_time / liquid.slowest_time
        times = f"process time {liquid.solder.process_time:.3g} s is {ratio:.3g} times the slowest time"
        rest = "the motion matters" if liquid.is_transient else "quasi-static, only the shape at rest matters"
        return decision(liquid.is_transient, f"{times} {liquid.slowest_time:.3g} s: {rest}", exp(-ratio))


class InertiaEffect(MotionEffect):
    """Inertia of the liquid."""

    name = "inertia"
    adds = "rho Dv/Dt"
    number = "T / max(sqrt(rho L^3 / gamma), rho L^2 / (5 mu)), process over slowest time"
    influence = "exp(-T / slowest time): what is left of the motion"
    implementation = "reflowshock.particles.physics.operators.Inertia"
    switch = "solder.effects.inertia = auto, on, off"
    source = "Lamb 1932, art. 355, decay of mode 2"

    def decide(self, liquid: LiquidScene) -> Decision:
        """Return on for an oscillating drop, otherwise decide as usual."""
        return decision(True, "a drop swings by its inertia") if liquid.swings else super().decide(liquid)


class ViscosityEffect(MotionEffect):
    """Newtonian viscosity, including wall friction."""

    name = "viscosity"
    adds = "-div(2 mu D(v))"
    number = "as inertia; Oh = mu / sqrt(rho gamma L) is given"
    influence = "exp(-T / slowest time): at rest it does nothing"
    implementation = "reflowshock.particles.physics.operators.Viscosity"
    switch = "solder.effects.viscosity = auto, on, off"
    source = "Lamb 1932, art. 355"

    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide as for inertia; always on if the user enables inertia, since only viscosity damps the motion."""
        outcome = super().auto(liquid)
        if liquid.solder.effects.inertia == "on":
            outcome = outcome | decision(True, "inertia is on: only viscosity brings the liquid to rest")
        return outcome | decision(outcome["on"], f"Ohnesorge number {liquid.numbers.ohnesorge:.3g}; {outcome['why']}")

    def decide(self, liquid: LiquidScene) -> Decision:
        """Return on for an oscillating drop, otherwise decide as usual."""
        if liquid.swings:
            return decision(True, f"Ohnesorge number {liquid.numbers.ohnesorge:.3g}: the swing decays")
        return super().decide(liquid)


class SurfaceTensionEffect(LiquidEffect):
    """Surface tension of the free surface."""

    name = "surface_tension"
    adds = "f = -gamma dA/dx, implicit: dt gamma K v"
    number = "Bo = rho g L H / gamma"
    threshold = LARGEST_BOND
    acts = "below"
    influence = "1 / sqrt(1 + Bo) of the shape: the capillary length over the size"
    implementation = "reflowshock.particles.physics.forces.SurfaceTension"
    switch = "solder.effects.surface_tension = auto, on, off"
    source = "de Gennes, Brochard-Wyart & Quere 2004, 2.1"

    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide by the Bond number of the acting weight."""
        rival = liquid.rival
        why = f"Bond number {rival:.3g} (off above {LARGEST_BOND:g})" if rival > 0.0 else "no gravity rivals it"
        return decision(rival < LARGEST_BOND, why, liquid.shaped)


class WallAdhesionEffect(LiquidEffect):
    """Contact angles."""

    name = "wall_adhesion"
    adds = "f = gamma cos(theta) dA_wet/dx, contact lines that edges pin"
    number = "Bo = rho g L H / gamma"
    threshold = LARGEST_BOND
    acts = "below"
    influence = "1 / sqrt(1 + Bo) of the shape, unless theta = 90 deg"
    implementation = "reflowshock.particles.physics.forces.Wetting"
    switch = "solder.effects.wall_adhesion = auto, on, off"
    source = "Young 1805; Brakke 1992"

    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide as for surface tension."""
        why = "contact angles of pad and mask hold or move the contact lines wherever surface tension acts"
        return decision(liquid.rival < LARGEST_BOND, why, liquid.shaped)

    def decide(self, liquid: LiquidScene) -> Decision:
        """Return off without a wall, regardless of the switch."""
        return super().decide(liquid) if liquid.has_wall else decision(False, "no wall")


>>>>>>> main
# In the order in which they are added to the physics: wall adhesion needs all other surface forces.
LIQUID_EFFECTS: tuple[LiquidEffect, ...] = (
    SurfaceTensionEffect(),
    GravityEffect(),
    WallAdhesionEffect(),
    ViscosityEffect(),
    InertiaEffect(),
)
AT_REST = {
    effect.name: False for effect in LIQUID_EFFECTS if effect.of_motion
}  # switched off where only the shape matters


def decide(numbers: Numbers, solder: Solder) -> dict[str, Decision]:
    """Decide on each effect of a reflow: name -> decision with its reason."""
    return decided(LIQUID_EFFECTS, LiquidScene(numbers, solder))


def decide_effects(geometry: JointGeometry, solder: Solder) -> dict[str, Decision]:
    """Decide on each effect of the reflow of a joint: name -> decision."""
    return decide(dimensionless_numbers(geometry, solder), solder)


def decide_drop(solder: Solder, is_free: bool) -> dict[str, Decision]:
    """Decide on each effect of a drop: name -> decision; wall effects are off for a free drop."""
    return decided(LIQUID_EFFECTS, LiquidScene(drop_numbers(solder), solder, has_wall=not is_free))


def decide_oscillation(solder: Solder) -> dict[str, Decision]:
    """Decide on each effect of a free oscillating drop: name -> decision."""
    return decided(LIQUID_EFFECTS, LiquidScene(drop_numbers(solder), solder, has_wall=False, swings=True))


def switched(effects: Mapping[str, Decision]) -> dict[str, bool]:
    """Return which effects are on: name -> bool."""
    return {name: decision["on"] for name, decision in effects.items()}


def acting(effects: Mapping[str, bool]) -> Iterator[LiquidEffect]:
    """Yield the effects that are on, in the order in which they are added to the physics.

    Args:
        effects: Name -> on or off; missing effects are off.

    Raises:
        KeyError: A name is unknown.
    """
    if unknown := effects.keys() - {effect.name for effect in LIQUID_EFFECTS}:
        raise KeyError(f"unknown effects of a reflow: {', '.join(sorted(unknown))}")
    return (effect for effect in LIQUID_EFFECTS if effects.get(effect.name, False))


def acting_weight(solder: Solder, effects: Mapping[str, Decision]) -> float:
    """Return the acting specific weight [N/m^3], the sum over the effects that are on; rho g with gravity alone."""
    return sum((effect.weight(solder) for effect in acting(switched(effects))), 0.0)


def asymmetric_effect(effects: Mapping[str, Decision]) -> LiquidEffect | None:
    """Return the first effect that is on and breaks the axis and the planes of symmetry of a drop; None without one."""
    return next((effect for effect in acting(switched(effects)) if not effect.is_axisymmetric), None)


def reference_weight(solder: Solder, effects: Mapping[str, Decision]) -> float | None:
    """Return the specific weight of the Young-Laplace reference [N/m^3]; None if the shapes are not axisymmetric."""
    return None if asymmetric_effect(effects) else acting_weight(solder, effects)
