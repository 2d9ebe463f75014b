"""Effects, size and cost of a flow by delta-SPH, and its table of the plan."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any

from rich.console import RenderableType

from reflowshock.particles.parameters.flow_effects import decide_flow
from reflowshock.particles.parameters.flows import DamBreak, SphFlow, TaylorGreen, largest_time_step
from reflowshock.units import from_si
from reflowshock.workflow.case.forecast import Size
from reflowshock.workflow.case.text import short
from reflowshock.workflow.fluid.case import FlowCase
from reflowshock.workflow.process.terminal import new_table

# On one core of an AMD EPYC, in a plane: of a step and of each of its particles; processor times of cases/dam_break.
SECONDS_PER_STEP, SECONDS_PER_PARTICLE = 2.0e-4, 1.1e-6
SECONDS_TO_START = 3.0  # until a stage has loaded its libraries and kernels
BYTES_OF_PARTICLE = 500.0  # a third of it is the list of neighbours


@dataclass(frozen=True, slots=True)
class FlowForecast:
    """What a flow will be like.

    Attributes:
        effects: effect -> {"on", "why"}.
        particles: of the liquid.
        spacing: theirs [m].
        time_step: expected [s].
        steps: expected number.
        seconds: stage -> predicted wall time [s].
    """

    effects: Mapping[str, Any]
    particles: int
    spacing: float
    time_step: float
    steps: int
    seconds: dict[str, float]


def forecast_flow(case: FlowCase) -> FlowForecast:
    """Predict effects, size, time step and cost of a flow."""
    scene: SphFlow = case.scene
    effects = decide_flow(scene)
    step = time_step(scene, effects["flow_viscosity"]["on"])
    steps = ceil(scene.until / step)
    seconds = SECONDS_TO_START + steps * (SECONDS_PER_STEP + SECONDS_PER_PARTICLE * scene.particles)
    return FlowForecast(effects, scene.particles, scene.spacing, step, steps, {"particles": seconds})


def time_step(scene: SphFlow, is_viscous: bool) -> float:
    """Return the time step that a flow is expected to take [s]."""
    length, viscosity = scene.numerics.smoothing_length * scene.spacing, scene.viscosity if is_viscous else 0.0
    return largest_time_step(length, scene.sound + scene.fastest, scene.density, viscosity)


def flow_size(case: FlowCase) -> Size:
    """Predict what the stages of a case take."""
    outlook = forecast_flow(case)
    return Size(outlook.seconds, 1, BYTES_OF_PARTICLE * outlook.particles)


def flow_tables(case: FlowCase, outlook: FlowForecast) -> Iterator[RenderableType]:
    """Yield particles, speeds and time steps."""
    scene: SphFlow = case.scene
    table = new_table("\nFlow", "what", "value", "remark")
    table.add_row("particles", f"{outlook.particles}", f"{1e3 * outlook.spacing:.3g} mm spacing at the start")
    numbers = f"of {from_si(scene.length, 'mm', digits=3)} and {from_si(scene.fastest, 'm/s', digits=3)}"
    table.add_row("Reynolds number", f"{scene.reynolds:.3g}", numbers)
    ratio = f"{scene.numerics.sound_speed:g} times the largest speed expected"
    table.add_row("speed of sound", from_si(scene.sound, "m/s", digits=3), ratio)
    table.add_row("time step", short(outlook.time_step), f"{outlook.steps} steps for {short(scene.until)}")
    if isinstance(scene, DamBreak):
        table.add_row("unit of time", short(scene.unit_of_time), "sqrt(H / g)")
    if isinstance(scene, TaylorGreen):
        table.add_row("exact solution", "Taylor & Green", "the largest speed dies out by exp(-8 pi² nu t / L²)")
    yield table
