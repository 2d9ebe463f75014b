"""Effects of delta-SPH flows, decided from the Reynolds number; loads no numerical library."""

from abc import abstractmethod
from math import sqrt
from typing import Any, cast

from reflowshock.effect import Decision, Effect, decide_all, decision
from reflowshock.parameters import with_value
from reflowshock.particles.flows.flow import FlowScene
from reflowshock.particles.flows.sph_numerics import ARTIFICIAL_VISCOSITY, MethodNumerics

# Boundary layer thickness over the length of the flow, below which viscosity is neglected.
THIN_LAYER = 0.01


class FlowEffect(Effect[FlowScene]):
    """An effect of a flow.

    Attributes:
        methods: Methods that the effect belongs to; empty for all.
    """

    stage = "particles"
    methods: tuple[str, ...] = ()

    @abstractmethod
    def decide(self, scene: FlowScene) -> Decision:
        """Decide by the dimensionless numbers of the flow, unless the user sets the switch."""


class FlowViscosity(FlowEffect):
    """Newtonian viscosity."""

    name = "flow_viscosity"
    adds = "div(2 mu D(v)) / rho"
    number = "1 / sqrt(Re), Re = rho U L / mu: boundary layer over length"
    threshold = THIN_LAYER
    influence = "the number; walls of a dam break are smooth, without such a layer"
    implementation = "reflowshock.particles.sph.pair_terms.shear_viscosity"
    switch = "<scene>.effects.viscosity = auto, on, off"
    source = "Morris et al. 1997; Cleary 1998"

    def decide(self, scene: FlowScene) -> Decision:
        """Decide by the boundary layer thickness, unless the user sets the switch."""
        layer = 1.0 / sqrt(scene.reynolds_number)
        why = f"Reynolds number {scene.reynolds_number:.3g}: layers of {100.0 * layer:.2g} % of the length"
        switch = scene.effects.viscosity
        if switch != "auto":
            return decision(switch == "on", f"set to {switch} by the user ({why})", min(layer, 1.0))
        return decision(layer > THIN_LAYER, why, min(layer, 1.0))


class ArtificialViscosity(FlowEffect):
    """Artificial viscosity, which stabilises the flow of an inviscid liquid."""

    name = "artificial_viscosity"
    adds = "alpha h c0 (rho_0 / rho) sum pi_ij grad W V: nu = alpha h c0 / 8 in a plane"
    number = "alpha"
    influence = "nu t / L^2, nu = alpha h c0 / 8"
    implementation = "reflowshock.particles.sph.pair_terms.artificial_viscosity"
    switch = "<scene>.numerics.artificial_viscosity"
    methods = ("sph",)
    source = "Monaghan 1992; Antuono et al. 2012"

    def decide(self, scene: FlowScene) -> Decision:
        """Enable it where viscosity is off, unless the user sets alpha."""
        user_alpha, viscous = sph_numerics(scene).artificial_viscosity, FlowViscosity().decide(scene)["on"]
        alpha = artificial_viscosity(scene)
        kinematic_viscosity = sph_numerics(scene).smoothing_length * scene.spacing * sph_sound(scene) * alpha / 8.0
        influence = min(kinematic_viscosity * scene.until / scene.length**2, 1.0)
        if user_alpha is not None:
            return decision(user_alpha > 0.0, f"numerics.artificial_viscosity = {user_alpha:g}", influence)
        return decision(not viscous, "viscosity acts" if viscous else f"no viscosity acts: {alpha:g}", influence)


class ShearDependence(FlowEffect):
    """Shear-rate dependent viscosity."""

    name = "shear_dependent_viscosity"
    adds = "mu(sqrt(2 D : D)) in place of mu: power law or Carreau"
    influence = "of the largest viscosity over the least one; not predicted"
    implementation = "reflowshock.particles.sph.flow.shear_law"
    switch = "<scene>.rheology"
    source = "Carreau 1972; Bird, Armstrong, Hassager 1987"

    def decide(self, scene: FlowScene) -> Decision:
        """Enable it where the case specifies a rheology and viscosity is on."""
        rheology, viscous = scene.rheology, FlowViscosity().decide(scene)["on"]
        if rheology is None:
            return decision(False, "viscosity is constant: no rheology is given")
        why = f"{rheology.law.replace('_', ' ')}, exponent {rheology.exponent:g}"
        return decision(viscous, why if viscous else f"{why}, but viscosity does not act")

    def toggled(self, case: Any, acts: bool) -> Any | None:
        """Return the case with constant viscosity; None if the effect is off, since no rheology is specified."""
        return with_value(case, f"{case.kind}.rheology", None) if acts else None


FLOW_EFFECTS = (FlowViscosity(), ArtificialViscosity(), ShearDependence())


def sph_numerics(scene: FlowScene) -> MethodNumerics:
    """Return ``scene.numerics`` with the type of delta-SPH; the scene must use this method, which is not checked."""
    return cast(MethodNumerics, scene.numerics)


def sph_sound(scene: FlowScene) -> float:
    """Return the artificial speed of sound of a flow computed by delta-SPH [m/s].

    Args:
        scene: Parameters of the flow, whose largest speed and numerics set it.
    """
    return sph_numerics(scene).sound(scene.fastest)


def artificial_viscosity(scene: FlowScene) -> float:
    """Return the dimensionless coefficient alpha of the artificial viscosity: the user's value, or the default.

    Args:
        scene: Parameters of a flow that is computed by delta-SPH.
    """
    user_alpha = sph_numerics(scene).artificial_viscosity
    if user_alpha is not None:
        return user_alpha
    return 0.0 if FlowViscosity().decide(scene)["on"] else ARTIFICIAL_VISCOSITY


def decide_flow(scene: FlowScene) -> dict[str, Decision]:
    """Decide on all effects of a flow, the common and the specific ones of its scene.

    Args:
        scene: Parameters of the flow: liquid, sizes, switches of effects and numerics.

    Returns:
        Effect name -> state ``on``, reason ``why`` and, if predicted, ``influence``; only effects of the scene's
        method.
    """
    method = scene.numerics.method
    effects = [effect for effect in FLOW_EFFECTS if not effect.methods or method in effect.methods]
    return decide_all(effects, scene.unit_scene) | scene.decide_own_effects()
