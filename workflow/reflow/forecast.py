"""Load steps of a reflow coupled with board and package, and their prediction before a run."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from reflowshock.fem.problem.thermal import Thermal
from reflowshock.particles.parameters.solder import Solder
from reflowshock.problem import Problem
from reflowshock.workflow.reflow.between import thermal_effects

if TYPE_CHECKING:
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.workflow.package.case import PackageCase

from itertools import groupby


@dataclass(frozen=True, slots=True)
class LoadStep:
    """Loads on board and package other than solder: temperature [K], displacement of the die's corner [m]."""

    temperature: float
    corner: float


def load_steps(thermal: Thermal) -> list[LoadStep]:
    """Return the load steps with liquid solder, in order; in the last one its shape freezes.

    Heating divides the range from the reference to the peak into equal steps; cooling takes the same steps in reverse.
    Melting and solidification are separate load steps.

    Args:
        thermal: Temperatures [K], number of steps, and motion of the die's corner over temperature.

    Returns:
        Temperature [K] and displacement of the die's corner [m] of each step.
    """
    rise = (thermal.peak - thermal.reference) / thermal.steps
    way = [thermal.reference + rise * number for number in range(thermal.steps)] if rise > 0.0 else []
    heating = [thermal.melting, *(value for value in way if value > thermal.melting), thermal.peak]
    cooling = [*(value for value in reversed(way) if value > thermal.solidification), thermal.solidification]
    temperatures = [value for value, _ in groupby(heating + cooling)]
    return [LoadStep(value, thermal.corner(value)) for value in temperatures]


# Measured with the structures of tests/verification/test_workflow_coupling.py: a floating package needs
# three or four exchanges per load step, two-way coupling two, and one-way coupling one.
EXCHANGES_TO_FLOAT, EXCHANGES_TO_BEND, EXCHANGES_ONE_WAY = 4, 2, 1


@dataclass(frozen=True, slots=True)
class HeatedForecast:
    """Predicted load steps and exchanges.

    Attributes:
        effects: Decision by effect: {"on", "why"}.
        steps: Load steps with liquid solder.
        exchanges: Number of exchanges between solder and structure over all load steps; each costs about a reflow of
            all joints.
    """

    effects: dict
    steps: list[LoadStep]
    exchanges: int


def forecast_heated(case: "PackageCase", thermal: Thermal) -> HeatedForecast:
    """Predict load steps, effects, and number of exchanges between solder and structure of a coupled reflow.

    Args:
        case: Case of a package.
        thermal: Temperatures of the case.

    Returns:
        Decision on each effect, load steps with liquid solder, and total number of exchanges.
    """
    steps = load_steps(thermal)
    effects = thermal_effects(case, thermal, [step.temperature for step in steps])
    each = EXCHANGES_TO_BEND if effects["solder_force"]["on"] else EXCHANGES_ONE_WAY
    each = EXCHANGES_TO_FLOAT if thermal.package == "floating" else each
    return HeatedForecast(effects, steps, each * len(steps))


def problems(
    solder: Solder, geometries: "Mapping[str, JointGeometry]", thermal: Thermal, pitch: float
) -> Iterator[Problem]:
    """Yield problems of load steps, which compute the solder at rest: relevant inertia or viscosity, and lack of space.

    Args:
        solder: Solder of one joint.
        geometries: Geometry as drawn by joint name.
        thermal: Temperatures, and motion of the package.
        pitch: Distance of neighbouring joints [m].

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    yield from _no_time(solder, geometries)
    yield from _no_room(solder, min(geometry.gap for geometry in geometries.values()), thermal, pitch)


def _no_room(solder: Solder, gap: float, thermal: Thermal, pitch: float) -> Iterator[Problem]:
    """Yield the problem of a package that is lowered until the solder of a joint would fill its cell of the array."""
    lowest = thermal.lowest_corner
    needed = solder.volume / pitch**2
    if thermal.corner_displacement is None or lowest >= 0.0 or gap + lowest > needed:
        return
    limit = (needed - gap) * thermal.corner_displacement / lowest
    message = f"leaves {1e3 * (gap + lowest):.4g} mm of the {1e3 * gap:.4g} mm gap, too little for the solder"
    value = f"{1e3 * thermal.corner_displacement:.4g} mm"
    yield Problem("thermal.corner_displacement", message, value, f"> {1e3 * limit:.4g} mm")


def _no_time(solder: Solder, geometries: "Mapping[str, JointGeometry]") -> Iterator[Problem]:
    """Yield problems of inertia and viscosity that matter or, except with the scheme ispg, are switched on."""
    from reflowshock.particles.parameters.effects import AT_REST, decide_effects

    if solder.numerics.scheme == "ispg":
        by_numbers = solder.effects.model_copy(update=dict.fromkeys(AT_REST, "auto"))
        solder = solder.model_copy(update={"effects": by_numbers})
    effects = decide_effects(next(iter(geometries.values())), solder)
    for name in (name for name in AT_REST if effects[name]["on"]):
        message = f"cannot be combined with [thermal], whose load steps are at rest: {effects[name]['why']}"
        if getattr(solder.effects, name) == "auto":
            yield Problem("solder.process_time", message, None, "a slower process")
        else:
            allowed = 'off, or solder.effects.inertia = "on" with the scheme ispg'
            yield Problem(f"solder.effects.{name}", message, None, allowed)
