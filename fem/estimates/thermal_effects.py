"""The effects of heating on a reflow: how much of the gaps warpage and the solder's force would change.

Estimates from the plate theory of the layers, on the safe side, in closed form: ``plan`` asks before there is a mesh.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi

from reflowshock.effect import Decision, Effect, Switch, Toggle, decision
from reflowshock.fem.problem.thermal import KELVIN, Thermal
from reflowshock.materials.parameters import Material

NEGLIGIBLE = 1e-3  # of the gap, or of the pad's radius across it: below it an effect is left out
MARGIN = 1.25  # on the bow: a ring of substrate around the die, which the die holds back, bends it by up to that much


@dataclass(frozen=True, slots=True)
class PackageSizes:
    """Lengths [m] that decide.

    Attributes:
        board: Thickness.
        substrate: Thickness.
        die: Thickness.
        die_reach: From the centre of the die to its corner.
        reach: From the centre of the package to the outermost joint.
        pitch: Between joints.
        pad_radius: Of the wetted disc on the package.
        standoff: Gap of the joints.
    """

    board: float
    substrate: float
    die: float
    die_reach: float
    reach: float
    pitch: float
    pad_radius: float
    standoff: float


@dataclass(frozen=True, slots=True)
class PlateLayer:
    """A layer of a plate that bends both ways: E / (1 - nu) and E / (1 - nu^2) [Pa], expansion [1/K], thickness [m]."""

    both_ways: float
    one_way: float
    expansion: float
    thickness: float

    @classmethod
    def of(cls, material: Material, thickness: float) -> "PlateLayer":
        """Take the constants of a material in the plane, the stiffer axis of both."""
        constants = material.engineering_constants
        young, ratio = max(constants.young[:2]), constants.poisson[0]
        return cls(young / (1.0 - ratio), young / (1.0 - ratio**2), material.expansion[0], thickness)


def curvature(lower: PlateLayer, upper: PlateLayer) -> float:
    """Return the curvature [1/(m K)] of a plate of two layers, ends up if positive (Timoshenko, JOSA 11, 1925)."""
    m, n = lower.thickness / upper.thickness, lower.both_ways / upper.both_ways
    shape = 3.0 * (1.0 + m) ** 2 + (1.0 + m * n) * (m**2 + 1.0 / (m * n))
    mismatch = lower.expansion - upper.expansion
    return 6.0 * mismatch * (1.0 + m) ** 2 / ((lower.thickness + upper.thickness) * shape)


def rigidity(lower: PlateLayer, upper: PlateLayer) -> float:
    """Return the flexural rigidity [N m] of two layers about their common neutral plane."""
    a, b = (layer.one_way * layer.thickness for layer in (lower, upper))
    own = sum(layer.one_way * layer.thickness**3 for layer in (lower, upper)) / 12.0
    return own + a * b / (a + b) * (0.5 * (lower.thickness + upper.thickness)) ** 2


def warpage_number(thermal: Thermal, materials: Mapping[str, Material], sizes: PackageSizes) -> float:
    """Return by how much heating changes gaps over the standoff, or shifts pads over their radius; the larger one.

    Between centre and outermost joint: bow as if the die covered the package, and expansion of the package (its layers
    held together) against that of the board.
    """
    rise = thermal.peak - thermal.reference
    lower, upper = PlateLayer.of(materials["substrate"], sizes.substrate), PlateLayer.of(materials["die"], sizes.die)
    bow = MARGIN * abs(curvature(lower, upper)) * rise * sizes.reach**2 / 2.0
    forces = [layer.both_ways * layer.thickness for layer in (lower, upper)]
    together = sum(force * layer.expansion for force, layer in zip(forces, (lower, upper), strict=True)) / sum(forces)
    grown = (together, lower.expansion)
    shift = max(abs(own - materials["board"].expansion[0]) for own in grown) * rise * sizes.reach
    return max(bow / sizes.standoff, shift / sizes.pad_radius)


def solder_force_number(materials: Mapping[str, Material], sizes: PackageSizes, surface_tension: float) -> float:
    """Return by how much the solder's force changes gaps over the standoff.

    Each joint pulls with 2 pi a gamma, together a pressure q on plates that are held at the array's corner: 5 q r^4 /
    (64 D) of a simply supported disc (the greatest factor, nu = 0), under the die with the rigidity of both layers,
    beyond it as a cantilever of the substrate on the slope at the die's edge; the board as a disc of the array's size.
    Each pad also dents what it lies on, by F / (2 a E) of a stiff disc on a half-space, E of its thickness.
    """
    pressure = 2.0 * pi * sizes.pad_radius * surface_tension / sizes.pitch**2
    layers = [PlateLayer.of(materials[role], getattr(sizes, role)) for role in ("board", "substrate", "die")]
    board, substrate = (layer.one_way * layer.thickness**3 / 12.0 for layer in layers[:2])
    both, bent = rigidity(layers[1], layers[2]), min(sizes.die_reach, sizes.reach)
    beyond = sizes.reach - bent
    package = 5.0 * bent**4 / (64.0 * both) + beyond * bent**3 / (8.0 * both) + beyond**4 / (8.0 * substrate)
    dents = sum(
        pi * surface_tension / materials[role].engineering_constants.young[2] for role in ("board", "substrate")
    )
    bent_by = pressure * (package + 5.0 * sizes.reach**4 / (64.0 * board))
    return (bent_by + dents) / sizes.standoff


@dataclass(frozen=True, slots=True)
class Heated:
    """Board, package and liquid solder under a course of temperatures.

    Attributes:
        thermal: The course, and what the user wants.
        materials: Role -> its material.
        sizes: Of package and board.
        surface_tension: [N/m].
        temperatures: Of the load steps with liquid solder [K].
    """

    thermal: Thermal
    materials: Mapping[str, Material]
    sizes: PackageSizes
    surface_tension: float
    temperatures: Sequence[float]

    def by_solder(self) -> tuple[float, Decision]:
        """Return by how much of the gaps the solder's force bends, and whether it would act if plates bend."""
        number = solder_force_number(self.materials, self.sizes, self.surface_tension)
        what = f"the solder's pull bends package and board by {number:.3g} of the gap"
        return number, _switched(self.thermal.effects.solder_force, number, what)


class Heating(Effect[Heated]):
    """Temperature of board and package."""

    name, stage = "thermal", "reflow"
    adds = "temperature of board and package in load steps, T(t)"
    influence = "that of flexible"
    place = "reflowshock.workflow.reflow.forecast.LoadStep"
    switch = "[thermal], there or not"
    source = "J-STD-020"

    def decide(self, heated: Heated) -> Decision:
        """Say at which temperatures solder is liquid."""
        low, high, reference = min(heated.temperatures), max(heated.temperatures), heated.thermal.reference
        span = f"{len(heated.temperatures)} load steps from {low - KELVIN:.4g} to {high - KELVIN:.4g} °C"
        why = f"solder is liquid in {span}, all is flat at {reference - KELVIN:.4g} °C"
        return decision(high > low or high != reference, why)


class Flexible(Effect[Heated]):
    """Board and package that bend."""

    name, stage = "flexible", "reflow"
    adds = "div C : (eps - alpha dT) = 0 in board and package"
    number = "bow / standoff or shift of pads / their radius, the larger one"
    threshold = NEGLIGIBLE
    influence = "the number, of the gap or pad"
    place = "reflowshock.fem.statics.structure.ThermalStructure"
    switch = "thermal.effects.flexible = auto, on, off"
    source = "Timoshenko, JOSA 11, 1925, two layers"

    def decide(self, heated: Heated) -> Decision:
        """By heating or by the solder's force, whichever changes more."""
        warped = warpage_number(heated.thermal, heated.materials, heated.sizes)
        forced, force = heated.by_solder()
        what = f"heating changes gaps or places of pads by {warped:.3g} of their size"
        number, why = max((warped, what), (forced, force["why"]))
        return _switched(heated.thermal.effects.flexible, number, why)


class SolderForce(Effect[Heated]):
    """What the solder does to plates that bend."""

    name, stage = "solder_force", "reflow"
    adds = "the joints' wrenches on the plates that bend"
    number = "(bending under 2 pi a gamma a joint + dents) / standoff"
    threshold = NEGLIGIBLE
    influence = "the number, of the gap"
    place = "reflowshock.fem.statics.pads.Pads"
    switch = "thermal.effects.solder_force = auto, on, off"
    source = "Timoshenko & Woinowsky-Krieger 1959, art. 16"
    toggle = Toggle("thermal.effects.solder_force", "on", "off")

    def decide(self, heated: Heated) -> Decision:
        """By its own number, where plates bend."""
        flexible = Flexible().decide(heated)["on"]
        return heated.by_solder()[1] if flexible else decision(False, "board and package are rigid")


class ResidualStress(Effect[Heated]):
    """Stress of cooling in which the shock begins."""

    name = "residual_stress"
    adds = "sigma_0 of cooling, div C : (eps - alpha dT) = 0, as initial state"
    influence = "not predicted: solder at room temperature relaxes"
    place = "reflowshock.fem.statics.initial_state.InitialState"
    switch = "thermal.effects.residual_stress = on, off"
    source = "upper bound, no creep"
    toggle = Toggle("thermal.effects.residual_stress", "on", "off")

    def decide(self, heated: Heated) -> Decision:
        """Return the setting of the case."""
        return self.setting(heated.thermal)

    @staticmethod
    def setting(thermal: Thermal, of_cooling: str = "") -> Decision:
        """Return the setting of the case; ``of_cooling`` is added to the reason where the effect is on."""
        on = thermal.effects.residual_stress == "on"
        why = f"thermal.effects.residual_stress = {thermal.effects.residual_stress}"
        return decision(on, why + of_cooling if on else why)


HEATED_EFFECTS: tuple[Effect[Heated], ...] = (Heating(), Flexible(), SolderForce(), ResidualStress())


def _switched(switch: Switch, number: float, what: str) -> Decision:
    """Follow the user's switch, or else the number."""
    if switch != "auto":
        return decision(switch == "on", f"{what}, switched {switch}", number)
    return decision(number > NEGLIGIBLE, f"{what} ({'>' if number > NEGLIGIBLE else '<='} {NEGLIGIBLE:g})", number)
