"""The effects of flows by delta-SPH, decided from their Reynolds number. No numerical library is loaded here."""

from abc import abstractmethod
from math import sqrt
from typing import Any

from reflowshock.effect import Decision, Effect, decided, decision
from reflowshock.parameters import changed
from reflowshock.particles.parameters.droplets import Droplet
from reflowshock.particles.parameters.effects import NEGLIGIBLE_SHAPE_CHANGE, SHAPE_CHANGE_BY_BOND
from reflowshock.particles.parameters.flows import ARTIFICIAL_VISCOSITY, SphFlow
from reflowshock.particles.parameters.printing import LITTLE_FROZEN, Printing

# Thickness of a boundary layer, over the length of the flow: with less, viscosity is left out where walls are smooth.
THIN_LAYER = 0.01
# 1 / sqrt(We): with less, surface tension changes the spread of an impact by less than that.
LITTLE_TENSION = 0.01


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

    def decide(self, scene: SphFlow) -> Decision:
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

    def decide(self, scene: SphFlow) -> Decision:
        """Where the case gives a rheology, and viscosity acts."""
        given, viscous = scene.rheology, FlowViscosity().decide(scene)["on"]
        if given is None:
            return decision(False, "viscosity is constant: no rheology is given")
        why = f"{given.law.replace('_', ' ')}, exponent {given.exponent:g}"
        return decision(viscous, why if viscous else f"{why}, but viscosity does not act")

    def other_way(self, case: Any, acts: bool) -> Any | None:
        """Return a case of constant viscosity; where the case gives no rheology, none is known."""
        return changed(case, f"{case.kind}.rheology", None) if acts else None


class DropletTension(Effect[Droplet]):
    """Surface tension of a droplet, and the wetting of its wall."""

    name = "droplet_tension"
    stage = "particles"
    adds = "-d(gamma (A_free - cos(theta) A_wet))/dx, shared among the particles beside the surface"
    number = "1 / sqrt(We), We = rho U^2 D / gamma: square root of surface energy over kinetic energy"
    threshold = LITTLE_TENSION
    influence = "the number, for the spread of an impact; without an impact nothing else acts"
    place = "reflowshock.particles.sph.liquid_surface.LiquidSurface"
    switch = "droplet.effects.surface_tension = auto, on, off"
    source = "Pasandideh-Fard et al. 1996: D_max / D = sqrt((We + 12) / (3 (1 - cos theta) + 4 We / sqrt(Re)))"

    def decide(self, scene: Droplet) -> Decision:
        """By the Weber number, or as the user says."""
        number = min(1.0 / sqrt(scene.weber_number), 1.0) if scene.weber_number else 1.0
        why = f"Weber number {scene.weber_number:.3g}" if scene.impact_speed else "nothing else moves the drop"
        switch = scene.effects.surface_tension
        if switch != "auto":
            return decision(switch == "on", f"set to {switch} by the user ({why})", number)
        return decision(number > LITTLE_TENSION, why, number)


class DropletGravity(Effect[Droplet]):
    """Weight of a droplet on a wall."""

    name = "droplet_gravity"
    stage = "particles"
    adds = "g"
    number = "Bo = rho g D^2 / gamma"
    threshold = NEGLIGIBLE_SHAPE_CHANGE / SHAPE_CHANGE_BY_BOND
    influence = "0.2 Bo, of the height"
    place = "reflowshock.particles.sph.flow.law_of"
    switch = "droplet.effects.gravity = auto, on, off"
    source = "Bashforth & Adams 1883, tables"

    def decide(self, scene: Droplet) -> Decision:
        """By the Bond number, or as the user says; a free drop would only fall."""
        bond, switch = scene.bond, scene.effects.gravity
        if not scene.has_wall:
            return decision(False, "no wall: the drop would fall as a whole", 0.0)
        influence, why = min(SHAPE_CHANGE_BY_BOND * bond, 1.0), f"Bond number {bond:.3g}"
        if switch != "auto":
            return decision(switch == "on", f"set to {switch} by the user ({why})", influence)
        return decision(influence > NEGLIGIBLE_SHAPE_CHANGE, why, influence)


class InkFreezing(Effect[Printing]):
    """Freezing of printed drops on a cold plate."""

    name = "freezing"
    stage = "particles"
    adds = "de/dt = div(k grad T) / rho; a particle without half of its latent heat stands still"
    number = (
        "sqrt(delay / t_f), t_f = H^2 / (4 lambda^2 a): share of a drop's height that freezes before the next lands"
    )
    threshold = LITTLE_FROZEN
    influence = "the number; without freezing light cures the drops"
    place = "reflowshock.particles.sph.heat.Heat"
    switch = "printing.effects.freezing = auto, on, off"
    source = "Neumann's solution, as in Carslaw & Jaeger 1959; Cleary & Monaghan 1999; Voller & Prakash 1987"

    def decide(self, scene: Printing) -> Decision:
        """By the share that freezes, or as the user says."""
        freezing, switch = scene.freezing, scene.effects.freezing
        if freezing is None:
            return decision(False, "no freezing is given: light cures the drops")
        why = (
            f"Stefan number {freezing.stefan:.3g}: {100.0 * scene.share_frozen:.3g} % of a drop's height between drops"
        )
        if switch != "auto":
            why = f"set to {switch} by the user ({why})"
        return decision(scene.freezes, why, scene.share_frozen)

    def other_way(self, case: Any, acts: bool) -> Any | None:
        """Return a case whose drops are cured by light; where the case gives no freezing, none is known."""
        return changed(case, f"{case.kind}.freezing", None) if acts else None


FLOW_EFFECTS = (FlowViscosity(), ArtificialViscosity(), ShearDependence())
DROPLET_EFFECTS = (DropletTension(), DropletGravity())
PRINTING_EFFECTS = (InkFreezing(),)


def artificial_viscosity(scene: SphFlow) -> float:
    """Return alpha."""
    given = scene.numerics.artificial_viscosity
    if given is not None:
        return given
    return 0.0 if FlowViscosity().decide(scene)["on"] else ARTIFICIAL_VISCOSITY


def decide_flow(scene: SphFlow) -> dict[str, Decision]:
    """Decide on all effects of a flow."""
    if isinstance(scene, Printing):
        return decide_flow(scene.drop) | decided(PRINTING_EFFECTS, scene)
    found = decided(FLOW_EFFECTS, scene)
    return found | decided(DROPLET_EFFECTS, scene) if isinstance(scene, Droplet) else found
