"""Contact angles as an effect of a reflow, decided from the Bond number."""

from reflowshock.effect import Decision, decision
from reflowshock.particles.parameters.liquid_effect import LARGEST_BOND, LiquidEffect, LiquidScene


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
    needs_wall = True
    section_implementation = "reflowshock.particles.section.forces.PolylineWetting"
    source = "Young 1805; Brakke 1992"

    def auto(self, liquid: LiquidScene) -> Decision:
        """Decide as for surface tension."""
        why = "contact angles of pad and mask hold or move the contact lines wherever surface tension acts"
        return decision(liquid.rival < LARGEST_BOND, why, liquid.shaped)
