"""Viscosity as an effect of a reflow, decided from the process time."""

from reflowshock.effect import Decision, decision
from reflowshock.particles.parameters.liquid_effect import LiquidScene, MotionEffect


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
