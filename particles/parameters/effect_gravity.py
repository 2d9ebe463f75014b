"""Gravity as an effect of a reflow, decided from the Bond number."""

from reflowshock.effect import Decision, decision
from reflowshock.particles.parameters.liquid_effect import LiquidEffect, LiquidScene
from reflowshock.particles.parameters.solder import Solder

# The height of a drop changes by 0.08, 0.13, 0.19 Bo at contact angles of 60, 120, 148 deg (Bashforth-Adams table);
# effects that change the shape by less than 0.1 % are neglected.
SHAPE_CHANGE_BY_BOND = 0.2
NEGLIGIBLE_SHAPE_CHANGE = 1e-3


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
    needs_wall = True
    without_wall = "no wall: the drop falls as a whole, which does not change its shape"
    section_implementation = "reflowshock.particles.section.forces.PolylineWeight"
    is_measured = True

    @property
    def key(self) -> str:
        """Key of the switch in a case of solder alone, a key of the scene."""
        return "gravity"

    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide by the relative change of the height."""
        change = SHAPE_CHANGE_BY_BOND * liquid.numbers.bond
        why = f"Bond number {liquid.numbers.bond:.3g}: changes the shape by about {100 * change:.3g} %"
        return decision(change > NEGLIGIBLE_SHAPE_CHANGE, why, min(change, 1.0))

    def weight(self, solder: Solder) -> float:
        """Return the specific weight rho g [N/m^3]."""
        return solder.density * solder.gravity
