"""Surface tension as an effect of a reflow, decided from the Bond number."""

from reflowshock.effect import Decision, decision
from reflowshock.particles.parameters.liquid_effect import LARGEST_BOND, LiquidEffect, LiquidScene


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
    section_implementation = "reflowshock.particles.section.forces.PolylineTension"
    source = "de Gennes, Brochard-Wyart & Quere 2004, 2.1"

    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide by the Bond number of the acting weight."""
        rival = liquid.rival
        why = f"Bond number {rival:.3g} (off above {LARGEST_BOND:g})" if rival > 0.0 else "no gravity rivals it"
        return decision(rival < LARGEST_BOND, why, liquid.shaped)
