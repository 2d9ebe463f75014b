"""Inertia as an effect of a reflow, decided from the process time."""

from reflowshock.effect import Decision, decision
from reflowshock.particles.parameters.liquid_effect import LiquidScene, MotionEffect


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
