"""The effects of flows by delta-SPH, decided from their Reynolds number. No numerical library is loaded here."""

from abc import abstractmethod
from math import sqrt
from typing import Any

from reflowshock.effect import Decision, Effect, decided, decision
from reflowshock.parameters import changed
from reflowshock.particles.flows.flow import FlowScene
from reflowshock.particles.flows.sph_numerics import ARTIFICIAL_VISCOSITY

# Thickness of a boundary layer, over the length of the flow: with less, viscosity is left out where walls are smooth.
THIN_LAYER = 0.01


class FlowEffect(Effect[FlowScene]):
    """An effect of a flow."""

    stage = "particles"

    @abstractmethod
    def decide(self, scene: FlowScene) -> Decision:
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

    def decide(self, scene: FlowScene) -> Decision:
        """By the boundary layer, or as the user says."""
        layer = 1.0 / sqrt(scene.reynolds_number)
        why = f"Reynolds number {scene.reynolds_number:.3g}: layers of {100.0 * layer:.2g} % of the length"
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

    def decide(self, scene: FlowScene) -> Decision:
        """Where viscosity does not act, or as the user says."""
        given, viscous = scene.numerics.artificial_viscosity, FlowViscosity().decide(scene)["on"]
        alpha = artificial_viscosity(scene)
        own = scene.numerics.smoothing_length * scene.spacing * scene.sound * alpha / 8.0
        influence = min(own * scene.until / scene.length**2, 1.0)
        if given is not None:
            return decision(given > 0.0, f"numerics.artificial_viscosity = {given:g}", influence)
        return decision(not viscous, "viscosity acts" if viscous else f"no viscosity acts: {alpha:g}", influence)


class ShearDependence(FlowEffect):
    """Viscosity that depends on the rate of shear."""

    name = "shear_dependent_viscosity"
    adds = "mu(sqrt(2 D : D)) in place of mu: power law or Carreau"
    influence = "of the largest viscosity over the least one; not predicted"
    place = "reflowshock.particles.sph.flow.shear_law"
    switch = "<scene>.rheology"
    source = "Carreau 1972; Bird, Armstrong, Hassager 1987"

    def decide(self, scene: FlowScene) -> Decision:
        """Where the case gives a rheology, and viscosity acts."""
        given, viscous = scene.rheology, FlowViscosity().decide(scene)["on"]
        if given is None:
            return decision(False, "viscosity is constant: no rheology is given")
        why = f"{given.law.replace('_', ' ')}, exponent {given.exponent:g}"
        return decision(viscous, why if viscous else f"{why}, but viscosity does not act")

    def other_way(self, case: Any, acts: bool) -> Any | None:
        """Return a case of constant viscosity; where the case gives no rheology, none is known."""
        return changed(case, f"{case.kind}.rheology", None) if acts else None


FLOW_EFFECTS = (FlowViscosity(), ArtificialViscosity(), ShearDependence())


def artificial_viscosity(scene: FlowScene) -> float:
    """Return alpha."""
    given = scene.numerics.artificial_viscosity
    if given is not None:
        return given
    return 0.0 if FlowViscosity().decide(scene)["on"] else ARTIFICIAL_VISCOSITY


def decide_flow(scene: FlowScene) -> dict[str, Decision]:
    """Decide on all effects of a flow: those of every flow, then those of its kind."""
    return decided(FLOW_EFFECTS, scene.unit_scene) | scene.decide_own_effects()
