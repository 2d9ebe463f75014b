"""The effects of flows by delta-SPH, decided from their Reynolds number. No numerical library is loaded here."""

from abc import abstractmethod
from math import sqrt

from reflowshock.effect import Decision, Effect, decided, decision
from reflowshock.particles.parameters.flows import ARTIFICIAL_VISCOSITY, SphFlow

# Thickness of a boundary layer, over the length of the flow: with less, viscosity is left out where walls are smooth.
THIN_LAYER = 0.01


class FlowEffect(Effect[SphFlow]):
    """An effect of a flow."""

    stage = "particles"

    @abstractmethod
    def decide(self, scene: SphFlow) -> Decision:
        """Decide from the flow's numbers, or as the user says."""


class FlowViscosity(FlowEffect):
    """Newtonian viscosity."""

    name = "flow_viscosity"
    adds = "div(2 mu D(v)) / rho"
    number = "1 / sqrt(Re), Re = rho U L / mu: boundary layer over length"
    threshold = THIN_LAYER
    influence = "the number; walls of a dam break are smooth, without such a layer"
    place = "reflowshock.particles.sph.pair_terms.shear_viscosity"
    switch = "<scene>.effects.viscosity = auto, on, off"
    source = "Morris et al. 1997; Cleary 1998"

    def decide(self, scene: SphFlow) -> Decision:
        """By the boundary layer, or as the user says."""
        layer = 1.0 / sqrt(scene.reynolds)
        why = f"Reynolds number {scene.reynolds:.3g}: layers of {100.0 * layer:.2g} % of the length"
        switch = scene.effects.viscosity
        if switch != "auto":
            return decision(switch == "on", f"set to {switch} by the user ({why})", min(layer, 1.0))
        return decision(layer > THIN_LAYER, why, min(layer, 1.0))


class ArtificialViscosity(FlowEffect):
    """Viscosity of the method, which smooths shocks of liquid that has none of its own."""

    name = "artificial_viscosity"
    adds = "alpha h c0 (rho_0 / rho) sum pi_ij grad W V: nu = alpha h c0 / 8 in a plane"
    number = "alpha"
    influence = "nu t / L^2, nu = alpha h c0 / 8"
    place = "reflowshock.particles.sph.pair_terms.artificial_viscosity"
    switch = "<scene>.numerics.artificial_viscosity"
    source = "Monaghan 1992; Antuono et al. 2012"

    def decide(self, scene: SphFlow) -> Decision:
        """Where viscosity does not act, or as the user says."""
        given, viscous = scene.numerics.artificial_viscosity, FlowViscosity().decide(scene)["on"]
        alpha = artificial_viscosity(scene)
        own = scene.numerics.smoothing_length * scene.spacing * scene.sound * alpha / 8.0
        influence = min(own * scene.until / scene.length**2, 1.0)
        if given is not None:
            return decision(given > 0.0, f"numerics.artificial_viscosity = {given:g}", influence)
        return decision(not viscous, "viscosity acts" if viscous else f"no viscosity acts: {alpha:g}", influence)


FLOW_EFFECTS = (FlowViscosity(), ArtificialViscosity())


def artificial_viscosity(scene: SphFlow) -> float:
    """Return alpha."""
    given = scene.numerics.artificial_viscosity
    if given is not None:
        return given
    return 0.0 if FlowViscosity().decide(scene)["on"] else ARTIFICIAL_VISCOSITY


def decide_flow(scene: SphFlow) -> dict[str, Decision]:
    """Decide on all effects of a flow."""
    return decided(FLOW_EFFECTS, scene)
