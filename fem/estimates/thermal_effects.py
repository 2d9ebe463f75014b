"""Which effects a reflow calls for: how much of the gaps warpage and the solder's force would change.

Estimates from the plate theory of the layers, on the safe side, in closed form: ``plan`` asks before there is a mesh.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import Any

from reflowshock.fem.materials.parameters import Material
from reflowshock.fem.problem.thermal import Switch, Thermal

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


def decide(
    thermal: Thermal, materials: Mapping[str, Material], sizes: PackageSizes, surface_tension: float
) -> dict[str, dict[str, Any]]:
    """Decide which effects act between solder and structure.

    Args:
        thermal: Course of temperatures, and what the user wants.
        materials: Role -> its material.
        sizes: Of package and board.
        surface_tension: [N/m].

    Returns:
        ``flexible``, ``solder_force``, ``residual_stress`` -> on, why.
    """
    warped = warpage_number(thermal, materials, sizes)
    forced = solder_force_number(materials, sizes, surface_tension)
    force = _switched(
        thermal.effects.solder_force, forced, f"the solder's pull bends package and board by {forced:.3g} of the gap"
    )
    larger, why = max(
        (warped, f"heating changes gaps or places of pads by {warped:.3g} of their size"), (forced, force["why"])
    )
    flexible = _switched(thermal.effects.flexible, larger, why)
    flexible["influence"] = larger
    residual = thermal.effects.residual_stress
    rigid = {"on": False, "why": "board and package are rigid"}
    return {
        "flexible": flexible,
        "solder_force": force | {"influence": forced} if flexible["on"] else rigid,
        "residual_stress": {"on": residual == "on", "why": f"thermal.effects.residual_stress = {residual}"},
    }


def _switched(switch: Switch, number: float, what: str) -> dict[str, Any]:
    """Follow the user's switch, or else the number."""
    if switch != "auto":
        return {"on": switch == "on", "why": f"{what}, switched {switch}"}
    return {"on": number > NEGLIGIBLE, "why": f"{what} ({'>' if number > NEGLIGIBLE else '<='} {NEGLIGIBLE:g})"}
