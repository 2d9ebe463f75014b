"""Forecast of a flow: effects, particles, time steps and cost, and its table of the plan."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any

from rich.console import RenderableType

from reflowshock.particles.flows.flow import FlowScene
from reflowshock.particles.flows.flow_effects import decide_flow
from reflowshock.units import from_si
from reflowshock.workflow.case.forecast import Size
from reflowshock.workflow.case.text import duration, short
from reflowshock.workflow.flows.cost import BYTES_OF_PARTICLE, SHEAR_COST, Cost
from reflowshock.workflow.flows.flow_kind import STAGE, FlowCase, FlowKind, Row
from reflowshock.workflow.process.terminal import new_table

DAY = 86400.0  # [s]: a longer run needs a GPU or a coarser spacing
DEVICES = {"cpu": "on one core", "cuda": "on a GPU"}


@dataclass(frozen=True, slots=True)
class FlowForecast:
    """Forecast of a flow.

    Attributes:
        effects: Effect -> {"on", "why"}.
        particles: Number of liquid particles.
        spacing: Particle spacing [m].
        time_step: Expected time step [s].
        steps: Expected number of time steps.
        seconds: Stage -> predicted wall time on the device of the case [s].
        by_device: Cost on "cpu" (one core) and, if the flow supports it, on "cuda".
    """

    effects: Mapping[str, Any]
    particles: int
    spacing: float
    time_step: float
    steps: int
    seconds: dict[str, float]
    by_device: Mapping[str, Cost]


def forecast_flow(flow: FlowKind, case: FlowCase) -> FlowForecast:
    """Predict effects, size, time step and cost of a flow, without running it.

    Args:
        flow: Kind of flow, which gives the cost of a step.
        case: Case of this kind.

    Returns:
        Effects, number and spacing of the particles, time step, number of steps, wall time by stage and device [s].
    """
    scene: FlowScene = case.scene
    effects = decide_flow(scene)
    step = scene.expected_time_step(effects["flow_viscosity"]["on"])
    steps = ceil(scene.until / step)
    shear_factor = SHEAR_COST if effects["shear_dependent_viscosity"]["on"] else 1.0
    by_device = flow.costs(scene, steps, shear_factor)
    chosen = by_device.get(getattr(scene.numerics, "device", "cpu"), by_device["cpu"])
    return FlowForecast(effects, scene.particles, scene.spacing, step, steps, {STAGE: chosen.seconds}, by_device)


def flow_size(flow: FlowKind, case: FlowCase) -> Size:
    """Predict wall times and memory of the stages of a case.

    Args:
        flow: Kind of flow.
        case: Case of this kind.

    Returns:
        Seconds by stage, number of joints (1), and memory [B].
    """
    forecast = forecast_flow(flow, case)
    return Size(forecast.seconds, 1, BYTES_OF_PARTICLE * forecast.particles)


def flow_tables(flow: FlowKind, case: FlowCase, forecast: FlowForecast) -> Iterator[RenderableType]:
    """Yield the table of particles, Reynolds number, speeds, time step and cost that ``plan`` prints.

    Args:
        flow: Kind of flow, with its unit of length and further rows.
        case: Case of this kind.
        forecast: Forecast of the case.
    """
    scene: FlowScene = case.scene
    length, spacing = (from_si(size, flow.length_unit, digits=3) for size in (scene.length, forecast.spacing))
    rows: list[Row] = [
        ("particles", f"{forecast.particles}", f"{spacing} initial spacing"),
        ("Reynolds number", f"{scene.reynolds_number:.3g}", f"{length} at {from_si(scene.fastest, 'm/s', digits=3)}"),
        *_sound_rows(scene),
        ("time step", short(forecast.time_step), f"{forecast.steps} steps for {short(scene.until)}"),
        *_device_rows(forecast, scene.dimension),
        *flow.plan_rows(scene),
    ]
    table = new_table("\nFlow", "quantity", "value", "remark")
    for row in rows:
        table.add_row(*row)
    yield table


def _sound_rows(scene: FlowScene) -> Iterator[Row]:
    """Yield the speed of sound of a compressible method."""
    sound = scene.numerics.sound(scene.fastest)
    if sound is not None:
        times = f"{sound / scene.fastest:g} times the largest expected speed"
        yield "speed of sound", from_si(sound, "m/s", digits=3), times


def _device_rows(forecast: FlowForecast, dimension: int) -> Iterator[Row]:
    """Yield the cost on each device, and the number of particles that would take one day there."""
    for device, cost in forecast.by_device.items():
        low, high = -9.0, 9.0  # decimal logarithm of the factor on the number of particles
        while high - low > 0.01:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if cost.refined(10.0**middle, dimension).seconds < DAY else (low, middle)
        limit = f"one day for about {forecast.particles * 10.0**low:.1g} particles"
        if cost.seconds > DAY:
            limit += "; try a GPU or a coarser spacing" if device == "cpu" else "; try a coarser spacing"
        yield DEVICES[device], f"about {duration(cost.seconds)}", limit
