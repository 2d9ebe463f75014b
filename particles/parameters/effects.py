"""Registry of the effects of a reflow and their decisions; loads no numerical library.

To add an effect, write a ``LiquidEffect`` in a file of its own and list it in ``LIQUID_EFFECTS``; its keys are in
``solder.py``.
"""

from collections.abc import Iterator, Mapping

from reflowshock.effect import Decision, decide_all
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
    """Decide on each effect of a reflow.

    Args:
        numbers: Dimensionless numbers of the joint or drop.
        solder: Fluid, process and the switches of the effects.

    Returns:
        Name of an effect, such as ``inertia`` -> state ``on``, reason ``why`` and, if predicted, ``influence``.
    """
    return decide_all(LIQUID_EFFECTS, LiquidScene(numbers, solder))


def decide_effects(geometry: JointGeometry, solder: Solder) -> dict[str, Decision]:
    """Decide on each effect of the reflow of a joint: name -> decision.

    A decision has the state ``on``, the reason ``why`` and, if predicted, the relative ``influence`` on the result.

    Args:
        geometry: Gap and radii of the joint.
        solder: Fluid, process and the switches of the effects.
    """
    return decide(dimensionless_numbers(geometry, solder), solder)


def decide_drop(solder: Solder, is_free: bool) -> dict[str, Decision]:
    """Decide on each effect of a drop.

    Args:
        solder: Fluid, process and the switches of the effects.
        is_free: Whether the drop is free of walls; wall effects are then off.

    Returns:
        Effect name -> state ``on``, reason ``why`` and, if predicted, ``influence``.
    """
    return decide_all(LIQUID_EFFECTS, LiquidScene(drop_numbers(solder), solder, has_wall=not is_free))


def decide_oscillation(solder: Solder) -> dict[str, Decision]:
    """Decide on each effect of a free oscillating drop: name -> decision.

    A decision has the state ``on``, the reason ``why`` and, if predicted, the relative ``influence`` on the result.

    Args:
        solder: Volume, fluid and the switches of the effects.
    """
    return decide_all(LIQUID_EFFECTS, LiquidScene(drop_numbers(solder), solder, has_wall=False, swings=True))


def switched(effects: Mapping[str, Decision]) -> dict[str, bool]:
    """Return whether each effect is on, name -> bool, from the decisions on them.

    Args:
        effects: Name -> decision, of which ``on`` is read.
    """
    return {name: decision["on"] for name, decision in effects.items()}


def acting(effects: Mapping[str, bool]) -> Iterator[LiquidEffect]:
    """Yield the records of the effects that are on, in the order in which they are added to the physics.

    Args:
        effects: Name of an effect, such as "inertia" -> on or off; missing effects are off.

    Raises:
        KeyError: A name is unknown.
    """
    if unknown := effects.keys() - {effect.name for effect in LIQUID_EFFECTS}:
        raise KeyError(f"unknown effects of a reflow: {', '.join(sorted(unknown))}")
    return (effect for effect in LIQUID_EFFECTS if effects.get(effect.name, False))


def acting_weight(solder: Solder, effects: Mapping[str, Decision]) -> float:
    """Return the acting specific weight [N/m^3], the sum over the effects that are on; rho g with gravity alone.

    Args:
        solder: Density, and values that other effects with a weight need.
        effects: Name -> decision, of which ``on`` is read.
    """
    return sum((effect.weight(solder) for effect in acting(switched(effects))), 0.0)


def asymmetric_effect(effects: Mapping[str, Decision]) -> LiquidEffect | None:
    """Return the record of the first effect that is on and breaks a drop's axis and planes of symmetry; None without.

    Args:
        effects: Name -> decision, of which ``on`` is read.
    """
    return next((effect for effect in acting(switched(effects)) if not effect.is_axisymmetric), None)


def reference_weight(solder: Solder, effects: Mapping[str, Decision]) -> float | None:
    """Return the specific weight of the Young-Laplace reference [N/m^3]; None if shapes are not axisymmetric.

    Args:
        solder: Density, and values that other effects with a weight need.
        effects: Name -> decision, of which ``on`` is read.
    """
    return None if asymmetric_effect(effects) else acting_weight(solder, effects)
