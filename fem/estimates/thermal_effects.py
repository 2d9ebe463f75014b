"""Effects of heating on a reflow: relative change of the gaps by warpage and by the solder's capillary force.

Conservative closed-form estimates from the plate theory of layers, for plans without a mesh.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi

from reflowshock.effect import Decision, Effect, Switch, Toggle, decision
from reflowshock.fem.problem.thermal import KELVIN, Thermal
from reflowshock.materials.parameters import Material

NEGLIGIBLE = 1e-3  # change of the gap over the standoff, or shift over the pad radius, below which an effect is off
MARGIN = 1.25  # safety factor on the bow: the ring of substrate around the die increases it by up to this factor


@dataclass(frozen=True, slots=True)
class PackageSizes:
    """Dimensions of package and board that decide on the effects of heating.

    Attributes:
        board: Thickness of the board [m].
        substrate: Thickness of the substrate [m].
        die: Thickness of the die [m].
        die_reach: Distance from the centre of the die to its corner [m].
        reach: Distance from the centre of the package to the outermost joint [m].
        pitch: Pitch of the joints [m].
        pad_radius: Radius of the wetted disc on the package [m].
        standoff: Gap of the joints [m].
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
    """Layer of a bending plate.

    Attributes:
        both_ways: Biaxial modulus E / (1 - nu) [Pa].
        one_way: Plate modulus E / (1 - nu^2) [Pa].
        expansion: Thermal expansion [1/K].
        thickness: Thickness [m].
    """

    both_ways: float
    one_way: float
    expansion: float
    thickness: float

    @classmethod
    def of(cls, material: Material, thickness: float) -> "PlateLayer":
        """Return the layer of a material, with the Young's modulus of its stiffer in-plane axis."""
        constants = material.engineering_constants
        young, ratio = max(constants.young[:2]), constants.poisson[0]
        return cls(young / (1.0 - ratio), young / (1.0 - ratio**2), material.expansion[0], thickness)


def _curvature(lower: PlateLayer, upper: PlateLayer) -> float:
    """Return the curvature of a two-layer plate per temperature rise [1/(m K)], positive if its edges move up.

    Source: Timoshenko, JOSA 11, 1925.
    """
    m, n = lower.thickness / upper.thickness, lower.both_ways / upper.both_ways
    shape = 3.0 * (1.0 + m) ** 2 + (1.0 + m * n) * (m**2 + 1.0 / (m * n))
    mismatch = lower.expansion - upper.expansion
    return 6.0 * mismatch * (1.0 + m) ** 2 / ((lower.thickness + upper.thickness) * shape)


def _rigidity(lower: PlateLayer, upper: PlateLayer) -> float:
    """Return the flexural rigidity [N m] of two layers about their common neutral plane."""
    a, b = (layer.one_way * layer.thickness for layer in (lower, upper))
    separate = sum(layer.one_way * layer.thickness**3 for layer in (lower, upper)) / 12.0
    return separate + a * b / (a + b) * (0.5 * (lower.thickness + upper.thickness)) ** 2


def warpage_number(thermal: Thermal, materials: Mapping[str, Material], sizes: PackageSizes) -> float:
    """Return the larger of bow over standoff and shift of pads over their radius by heating, dimensionless.

    Both are differences between the centre and the outermost joint: the bow of a package that is covered by the die,
    and the mismatch of thermal expansion between package (bonded layers) and board.

    Args:
        thermal: Temperature profile; the rise is from ``reference`` to ``peak``.
        materials: Materials by role (board, substrate, die).
        sizes: Dimensions of package and board.
    """
    rise = thermal.peak - thermal.reference
    lower, upper = PlateLayer.of(materials["substrate"], sizes.substrate), PlateLayer.of(materials["die"], sizes.die)
    bow = MARGIN * abs(_curvature(lower, upper)) * rise * sizes.reach**2 / 2.0
    forces = [layer.both_ways * layer.thickness for layer in (lower, upper)]
    together = sum(force * layer.expansion for force, layer in zip(forces, (lower, upper), strict=True)) / sum(forces)
    expansions = (together, lower.expansion)
    shift = max(abs(expansion - materials["board"].expansion[0]) for expansion in expansions) * rise * sizes.reach
    return max(bow / sizes.standoff, shift / sizes.pad_radius)


def solder_force_number(materials: Mapping[str, Material], sizes: PackageSizes, surface_tension: float) -> float:
    """Return the change of the gaps by the solder's capillary force over the standoff.

    Each joint pulls with F = 2 pi a gamma, which gives a pressure q on plates that are held at the corner of the array.
    A simply supported disc deflects by 5 q r^4 / (64 D) (largest factor, nu = 0): under the die with the rigidity D of
    both layers, beyond it as a cantilever of the substrate with the slope at the edge of the die; the board as a disc
    of the size of the array. Each pad also indents its plate by F / (2 a E), as a rigid disc on a half-space with the
    modulus E through the thickness.

    Args:
        materials: Materials by role (board, substrate, die).
        sizes: Dimensions of package and board.
        surface_tension: Surface tension gamma [N/m].
    """
    pressure = 2.0 * pi * sizes.pad_radius * surface_tension / sizes.pitch**2
    layers = [PlateLayer.of(materials[role], getattr(sizes, role)) for role in ("board", "substrate", "die")]
    board, substrate = (layer.one_way * layer.thickness**3 / 12.0 for layer in layers[:2])
    both, bent = _rigidity(layers[1], layers[2]), min(sizes.die_reach, sizes.reach)
    beyond = sizes.reach - bent
    package = 5.0 * bent**4 / (64.0 * both) + beyond * bent**3 / (8.0 * both) + beyond**4 / (8.0 * substrate)
    dents = sum(
        pi * surface_tension / materials[role].engineering_constants.young[2] for role in ("board", "substrate")
    )
    bent_by = pressure * (package + 5.0 * sizes.reach**4 / (64.0 * board))
    return (bent_by + dents) / sizes.standoff


@dataclass(frozen=True, slots=True)
class Heated:
    """Board, package and liquid solder under a temperature profile.

    Attributes:
        thermal: Temperature profile and switches of the effects.
        materials: Materials by role.
        sizes: Dimensions of package and board.
        surface_tension: Surface tension of the solder [N/m].
        temperatures: Temperatures of the load steps with liquid solder [K].
    """

    thermal: Thermal
    materials: Mapping[str, Material]
    sizes: PackageSizes
    surface_tension: float
    temperatures: Sequence[float]

    def by_solder(self) -> tuple[float, Decision]:
        """Return ``solder_force_number``, and the decision on the solder's force for flexible plates."""
        number = solder_force_number(self.materials, self.sizes, self.surface_tension)
        reason = f"the solder's pull bends package and board by {number:.3g} of the gap"
        return number, _switched(self.thermal.effects.solder_force, number, reason)


class Heating(Effect[Heated]):
    """Temperature of board and package."""

    name, stage = "thermal", "reflow"
    adds = "temperature of board and package in load steps, T(t)"
    influence = "the influence of flexible"
    implementation = "reflowshock.workflow.reflow.forecast.LoadStep"
    switch = "[thermal], present or absent"
    source = "J-STD-020"

    def decide(self, heated: Heated) -> Decision:
        """Decide by the temperatures at which solder is liquid, and give them as reason."""
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
    implementation = "reflowshock.fem.statics.structure.ThermalStructure"
    switch = "thermal.effects.flexible = auto, on, off"
    source = "Timoshenko, JOSA 11, 1925, two layers"

    def decide(self, heated: Heated) -> Decision:
        """Decide by heating or by the solder's force, whichever changes the gaps more."""
        warped = warpage_number(heated.thermal, heated.materials, heated.sizes)
        forced, force = heated.by_solder()
        reason = f"heating changes gaps or positions of pads by {warped:.3g} of their size"
        number, why = max((warped, reason), (forced, force["why"]))
        return _switched(heated.thermal.effects.flexible, number, why)


class SolderForce(Effect[Heated]):
    """Capillary force of the solder on flexible plates."""

    name, stage = "solder_force", "reflow"
    adds = "forces and moments of the joints on the flexible plates"
    number = "(bending under 2 pi a gamma per joint + indentation) / standoff"
    threshold = NEGLIGIBLE
    influence = "the number, of the gap"
    implementation = "reflowshock.fem.statics.pads.Pads"
    switch = "thermal.effects.solder_force = auto, on, off"
    source = "Timoshenko & Woinowsky-Krieger 1959, art. 16"
    toggle = Toggle("thermal.effects.solder_force", "on", "off")

    def decide(self, heated: Heated) -> Decision:
        """Decide by ``solder_force_number`` if the plates are flexible; otherwise the effect is off."""
        flexible = Flexible().decide(heated)["on"]
        return heated.by_solder()[1] if flexible else decision(False, "board and package are rigid")


class ResidualStress(Effect[Heated]):
    """Residual stress of cooling as initial state of the shock."""

    name = "residual_stress"
    adds = "sigma_0 of cooling, div C : (eps - alpha dT) = 0, as initial state"
    influence = "not predicted: solder at room temperature relaxes"
    implementation = "reflowshock.fem.statics.initial_state.InitialState"
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


def _switched(switch: Switch, number: float, reason: str) -> Decision:
    """Decide by the switch of the case, or by the number if the switch is auto."""
    if switch != "auto":
        return decision(switch == "on", f"{reason}, switched {switch}", number)
    return decision(number > NEGLIGIBLE, f"{reason} ({'>' if number > NEGLIGIBLE else '<='} {NEGLIGIBLE:g})", number)
