"""What a reflow that is coupled with board and package would be like, before it runs."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fem.thermal.parameters import KELVIN, Thermal
from particles.parameters import Solder
from workflow.problems import Problem
from workflow.reflow.between import thermal_effects
from workflow.reflow.load_steps import LoadStep, load_steps

if TYPE_CHECKING:
    from particles.geometry import JointGeometry
    from workflow.board_drop_case import PackageCase

# Measured with the structures of tests/verification/test_workflow_coupling.py: a package that floats is sought by
# three or four exchanges a load step, forces that bend need two, and one way none beyond the first.
EXCHANGES_TO_FLOAT, EXCHANGES_TO_BEND, EXCHANGES_ONE_WAY = 4, 2, 1


@dataclass(frozen=True, slots=True)
class HeatedForecast:
    """What is foreseen.

    Attributes:
        effects: effect -> {"on", "why"}.
        steps: load steps with liquid solder.
        exchanges: between solder and structure, over all load steps; each costs about a reflow of all joints.
    """

    effects: dict
    steps: list[LoadStep]
    exchanges: int


def forecast_heated(case: "PackageCase", thermal: Thermal) -> HeatedForecast:
    """Foresee load steps, exchanges and effects."""
    steps, effects = load_steps(thermal), thermal_effects(case, thermal)
    each = EXCHANGES_TO_BEND if effects["solder_force"]["on"] else EXCHANGES_ONE_WAY
    each = EXCHANGES_TO_FLOAT if thermal.package == "floating" else each
    return HeatedForecast({"thermal": thermal_effect(thermal, steps)} | effects, steps, each * len(steps))


def thermal_effect(thermal: Thermal, steps: list[LoadStep]) -> dict:
    """Say at which temperatures solder is liquid, as an effect."""
    low, high = (extreme(step.temperature for step in steps) for extreme in (min, max))
    reference = thermal.reference - KELVIN
    why = f"solder is liquid in {len(steps)} load steps from {low - KELVIN:.4g} to {high - KELVIN:.4g} degC"
    return {"on": bool(high > low or high != thermal.reference), "why": f"{why}, all is flat at {reference:.4g} degC"}


def problems(solder: Solder, geometries: "Mapping[str, JointGeometry]") -> Iterator[Problem]:
    """Find a motion that matters where load steps have no time: each is the solder at rest."""
    from particles.effects import decide_effects

    for geometry in list(geometries.values())[:1]:
        for name in ("inertia", "viscosity"):
            effect = decide_effects(geometry, solder)[name]
            if effect["on"]:
                key = "solder.process_time" if getattr(solder.effects, name) == "auto" else f"solder.effects.{name}"
                yield Problem(
                    key, f"load steps of [thermal] are at rest, but {effect['why']}", None, "a slower process"
                )
