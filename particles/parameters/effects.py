"""Which effects a reflow calls for, decided from dimensionless numbers. No numerical library is loaded here."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import exp, pi, sqrt
from typing import Any, NotRequired, TypedDict

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder

# Height of a drop changes by 0.08, 0.13, 0.19 Bo at contact angles of 60, 120, 148 deg (Bashforth-Adams table); what
# changes less than 0.1 % of the shape is left out.
SHAPE_CHANGE_BY_BOND = 0.2
NEGLIGIBLE_SHAPE_CHANGE = 1e-3
# A motion has died out when the process is so many times longer than its slowest time.
PROCESS_TIME_RATIO = 20.0
# Below this Bond number surface tension decides the shape; above 100 it is a boundary layer of gravity.
LARGEST_BOND = 100.0


class Decision(TypedDict):
    """Whether an effect acts, why, and how much of the answer it is expected to change (or would)."""

    on: bool
    why: str
    influence: NotRequired[float]


NO_WALL: dict[str, Decision] = {
    "gravity": {"on": False, "why": "no wall: the drop falls as a whole, which does not change its shape"},
    "wall_adhesion": {"on": False, "why": "no wall"},
}


@dataclass(frozen=True, slots=True)
class Numbers:
    """Dimensionless numbers and times of a joint or drop.

    Attributes:
        bond: rho g L H / gamma, weight over surface tension.
        ohnesorge: mu / sqrt(rho gamma L).
        capillary_time: sqrt(rho L^3 / gamma) [s].
        viscous_time: rho L^2 / (5 mu) [s], in which the slowest oscillation decays (Lamb 1932, mode 2).
    """

    bond: float
    ohnesorge: float
    capillary_time: float
    viscous_time: float


def dimensionless_numbers(geometry: JointGeometry, solder: Solder) -> Numbers:
    """Numbers of a joint; L is the radius of a cylinder of the joint's volume and gap, H the gap."""
    length = sqrt(solder.volume / (pi * geometry.gap))
    return _numbers(solder, length, length * geometry.gap)


def drop_numbers(solder: Solder) -> Numbers:
    """Numbers of a drop: its Bond number with V^(1/3), times and Ohnesorge number with the radius of its sphere."""
    return _numbers(solder, (0.75 * solder.volume / pi) ** (1.0 / 3.0), solder.volume ** (2.0 / 3.0))


def _numbers(solder: Solder, length: float, area: float) -> Numbers:
    """Numbers from the length that times are made of [m] and the area of the Bond number [m^2]."""
    density, tension = solder.density, solder.surface_tension
    return Numbers(
        bond=density * solder.gravity * area / tension,
        ohnesorge=solder.viscosity / sqrt(density * tension * length),
        capillary_time=sqrt(density * length**3 / tension),
        viscous_time=density * length**2 / (5.0 * solder.viscosity),
    )


def switched(effects: Mapping[str, Decision]) -> dict[str, bool]:
    """Which effects act: name to on or off."""
    return {name: decision["on"] for name, decision in effects.items()}


def acting_weight(solder: Solder, effects: Mapping[str, Decision]) -> float:
    """Weight of the unit volume that acts [N/m^3]."""
    return solder.density * solder.gravity if effects["gravity"]["on"] else 0.0


def _by_switch(switch: str, auto: Decision) -> Decision:
    if switch == "auto":
        return auto
    set_by_user: Decision = {"on": switch == "on", "why": f"set to {switch} by the user ({auto['why']})"}
    return auto | set_by_user


def decide_effects(geometry: JointGeometry, solder: Solder) -> dict[str, Decision]:
    """Decide each effect of a joint's reflow: `decide` with its numbers."""
    return decide(dimensionless_numbers(geometry, solder), solder)


def decide_drop(solder: Solder, is_free: bool) -> dict[str, Decision]:
    """Decide each effect of a drop: `decide` with its numbers; what needs a wall is off where a drop is free."""
    numbers = drop_numbers(solder)
    return decide(replace(numbers, bond=0.0), solder) | NO_WALL if is_free else decide(numbers, solder)


def decide_oscillation(solder: Solder) -> dict[str, Decision]:
    """Decide each effect of a free drop that swings."""
    ohnesorge = drop_numbers(solder).ohnesorge
    motion: dict[str, Decision] = {
        "inertia": {"on": True, "why": "a drop swings by its inertia"},
        "viscosity": {"on": True, "why": f"Ohnesorge number {ohnesorge:.3g}: the swing decays"},
    }
    return decide_drop(solder, is_free=True) | motion


def decide(numbers: Numbers, solder: Solder) -> dict[str, Decision]:
    """Decide each effect of a reflow.

    Returns:
        For gravity, inertia, viscosity, surface_tension and wall_adhesion: on or off, and the reason with its number.
    """
    change = SHAPE_CHANGE_BY_BOND * numbers.bond
    rival = 0.0 if solder.effects.gravity == "off" else numbers.bond
    slowest = max(numbers.capillary_time, numbers.viscous_time)
    ratio = solder.process_time / slowest
    transient = ratio < PROCESS_TIME_RATIO
    times = f"process time {solder.process_time:.3g} s is {ratio:.3g} times the slowest time {slowest:.3g} s"
    moving = exp(-ratio)
    shaped = 1.0 / sqrt(1.0 + rival)  # of the size, where gravity makes a puddle as deep as the capillary length
    rest = f"{times}: " + ("the motion matters" if transient else "quasi-static, only the shape at rest matters")
    auto: dict[str, Decision] = {
        "gravity": {
            "on": change > NEGLIGIBLE_SHAPE_CHANGE,
            "why": f"Bond number {numbers.bond:.3g}: changes the shape by about {100 * change:.3g} %",
            "influence": min(change, 1.0),
        },
        "inertia": {"on": transient, "why": rest, "influence": moving},
        "viscosity": {
            "on": transient,
            "why": f"Ohnesorge number {numbers.ohnesorge:.3g}; {rest}",
            "influence": moving,
        },
        "surface_tension": {
            "on": rival < LARGEST_BOND,
            "why": f"Bond number {rival:.3g} (off above {LARGEST_BOND:g})" if rival > 0.0 else "no gravity rivals it",
            "influence": shaped,
        },
        "wall_adhesion": {
            "on": rival < LARGEST_BOND,
            "why": "contact angles of pad and mask hold or move the contact lines wherever surface tension acts",
            "influence": shaped,
        },
    }
    switches = solder.effects.model_dump()
    return {name: _by_switch(switches[name], decision) for name, decision in auto.items()}


ENTRIES: tuple[dict[str, Any], ...] = (
    {
        "name": "gravity",
        "adds": "f = -rho g z dV/dx on the free surface",
        "number": f"{SHAPE_CHANGE_BY_BOND:g} Bo, Bo = rho g L H / gamma",
        "threshold": NEGLIGIBLE_SHAPE_CHANGE,
        "influence": f"{SHAPE_CHANGE_BY_BOND:g} Bo of the shape, up to (large contact angles)",
        "place": "reflowshock.particles.physics.forces.Gravity",
        "switch": "solder.effects.gravity (of a scene: gravity) = auto, on, off",
        "source": "Bashforth & Adams 1883, heights of sessile drops",
    },
    {
        "name": "inertia",
        "adds": "rho Dv/Dt",
        "number": "T / max(sqrt(rho L^3 / gamma), rho L^2 / (5 mu)), process over slowest time",
        "threshold": PROCESS_TIME_RATIO,
        "acts": "below",
        "influence": "exp(-T / slowest time): what is left of the motion",
        "place": "reflowshock.particles.physics.operators.Inertia",
        "switch": "solder.effects.inertia = auto, on, off",
        "source": "Lamb 1932, art. 355, decay of mode 2",
    },
    {
        "name": "viscosity",
        "adds": "-div(2 mu D(v))",
        "number": "as inertia; Oh = mu / sqrt(rho gamma L) is given",
        "threshold": PROCESS_TIME_RATIO,
        "acts": "below",
        "influence": "exp(-T / slowest time): at rest it does nothing",
        "place": "reflowshock.particles.physics.operators.Viscosity",
        "switch": "solder.effects.viscosity = auto, on, off",
        "source": "Lamb 1932, art. 355",
    },
    {
        "name": "surface_tension",
        "adds": "f = -gamma dA/dx, implicit: dt gamma K v",
        "number": "Bo = rho g L H / gamma",
        "threshold": LARGEST_BOND,
        "acts": "below",
        "influence": "1 / sqrt(1 + Bo) of the shape: the capillary length over the size",
        "place": "reflowshock.particles.physics.forces.SurfaceTension",
        "switch": "solder.effects.surface_tension = auto, on, off",
        "source": "de Gennes, Brochard-Wyart & Quere 2004, 2.1",
    },
    {
        "name": "wall_adhesion",
        "adds": "f = gamma cos(theta) dA_wet/dx, contact lines that edges pin",
        "number": "Bo = rho g L H / gamma",
        "threshold": LARGEST_BOND,
        "acts": "below",
        "influence": "1 / sqrt(1 + Bo) of the shape, unless theta = 90 deg",
        "place": "reflowshock.particles.physics.forces.Wetting",
        "switch": "solder.effects.wall_adhesion = auto, on, off",
        "source": "Young 1805; Brakke 1992",
    },
)
