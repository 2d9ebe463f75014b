"""Effects, size and cost of a flow by delta-SPH, and its table of the plan."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any

from rich.console import RenderableType
from rich.table import Table

from reflowshock.particles.parameters.droplets import Droplet, cap
from reflowshock.particles.parameters.flow_effects import decide_flow
from reflowshock.particles.parameters.flows import CENTRAL, DamBreak, SphFlow, TaylorGreen, largest_time_step
from reflowshock.particles.parameters.printing import Printing
from reflowshock.units import from_si
from reflowshock.workflow.case.forecast import Size
from reflowshock.workflow.case.text import duration, short
from reflowshock.workflow.fluid.case import FlowCase, micrometres
from reflowshock.workflow.process.terminal import new_table

# On one core of an AMD EPYC, in a plane: of a step and of each of its particles; processor times of cases/dam_break.
SECONDS_PER_STEP, SECONDS_PER_PARTICLE = 1.3e-4, 2.9e-7
# In space, with a surface, on one core of an Intel Xeon: of a step, and of each particle with its triangles; drops of
# ink with 280 to 28 768 particles, benchmarks/bench_sph.py.
SECONDS_PER_STEP_IN_SPACE, SECONDS_PER_PARTICLE_IN_SPACE = 1.2e-3, 2.2e-6
# Printing, on that core: cured ink beside a drop, over a step and over its particles; of the ground and of the part of
# each drop that is printed, in each layer that is told of; cases/printing, 64 drops.
SECONDS_PER_STEP_ON_INK, SOLID_SHARE, SECONDS_PER_DROP_AND_LAYER = 1.0e-3, 0.5, 1.5e-2
# A step with a viscosity that depends on the rate of shear, over one without: an impact, 24 particles across.
SHEAR_COST = 1.53
# On a GPU, an NVIDIA H200, in space: of a step and of each of its particles, benchmarks/bench_sph.py; of a particle of
# a droplet, whose surface stays with the processor, there of 16 cores.
SECONDS_PER_GPU_STEP, SECONDS_PER_GPU_PARTICLE, SECONDS_PER_GPU_PARTICLE_WITH_SURFACE = 1.0e-3, 3.1e-9, 2.4e-7
DAY = 86400.0  # [s]: what takes longer needs a GPU or a coarser spacing
SECONDS_TO_START = 3.0  # until a stage has loaded its libraries and kernels
BYTES_OF_PARTICLE = 900.0  # half of it is the list of neighbours; on a GPU 970, measured


@dataclass(frozen=True, slots=True)
class Cost:
    """What a flow costs on a device.

    Attributes:
        steps: of time.
        fixed: wall time of a step whatever its particles [s].
        moving: that of its particles [s].
        once: what is measured at the end [s].
    """

    steps: float
    fixed: float
    moving: float
    once: float = 0.0

    @property
    def seconds(self) -> float:
        """Wall time [s]."""
        return SECONDS_TO_START + self.steps * (self.fixed + self.moving) + self.once

    def finer(self, times: float, dimension: int) -> "Cost":
        """Return the cost of so many times the particles: steps shrink with the spacing."""
        return Cost(self.steps * times ** (1.0 / dimension), self.fixed, self.moving * times, self.once * times)


@dataclass(frozen=True, slots=True)
class FlowForecast:
    """What a flow will be like.

    Attributes:
        effects: effect -> {"on", "why"}.
        particles: of the liquid.
        spacing: theirs [m].
        time_step: expected [s].
        steps: expected number.
        seconds: stage -> predicted wall time [s], on the device that the case names.
        by_device: "cpu", of which it is one core, and where it can be had "cuda" -> cost.
    """

    effects: Mapping[str, Any]
    particles: int
    spacing: float
    time_step: float
    steps: int
    seconds: dict[str, float]
    by_device: dict[str, Cost]


def forecast_flow(case: FlowCase) -> FlowForecast:
    """Predict effects, size, time step and cost of a flow."""
    scene: SphFlow = case.scene
    effects = decide_flow(scene)
    step = time_step(scene, effects["flow_viscosity"]["on"])
    steps = ceil(scene.until / step)
    in_space = isinstance(scene, Droplet | Printing)
    each = SECONDS_PER_PARTICLE_IN_SPACE if in_space else SECONDS_PER_PARTICLE
    if effects["shear_dependent_viscosity"]["on"]:
        each *= SHEAR_COST
    if isinstance(scene, Printing):
        by_device = {"cpu": _of_printing(scene, steps, each)}
    else:
        fixed = SECONDS_PER_STEP_IN_SPACE if in_space else SECONDS_PER_STEP
        by_device = {"cpu": Cost(steps, fixed, each * scene.particles)}
        share = SECONDS_PER_GPU_PARTICLE_WITH_SURFACE if in_space else SECONDS_PER_GPU_PARTICLE
        by_device["cuda"] = Cost(steps, SECONDS_PER_GPU_STEP, share * scene.particles)
    chosen = by_device.get(scene.numerics.device, by_device["cpu"])
    return FlowForecast(effects, scene.particles, scene.spacing, step, steps, {"particles": chosen.seconds}, by_device)


def _of_printing(scene: Printing, steps: int, each: float) -> Cost:
    """Return the cost of printing: one drop after the other moves, and cured ink counts as far as liquid reaches it.

    ``each``: of a particle in a step [s].
    """
    fixed = SECONDS_PER_STEP_IN_SPACE + SECONDS_PER_STEP_ON_INK
    at_once = scene.drop.particles * max(1.0, min(scene.cure_time / scene.delay, float(scene.drops)))
    told = SECONDS_PER_DROP_AND_LAYER * scene.drops * scene.layers
    return Cost(steps, fixed, each * at_once * (1.0 + SOLID_SHARE), told)


def time_step(scene: SphFlow, is_viscous: bool) -> float:
    """Return the time step that a flow is expected to take [s]."""
    length, viscosity = scene.numerics.smoothing_length * scene.spacing, 0.0
    if is_viscous:
        viscosity = scene.largest_viscosity * (CENTRAL if isinstance(scene, DamBreak | Droplet | Printing) else 1.0)
    tension = scene.surface_tension if isinstance(scene, Droplet | Printing) else 0.0
    return largest_time_step(length, scene.sound + scene.fastest, scene.density, viscosity, tension)


def flow_size(case: FlowCase) -> Size:
    """Predict what the stages of a case take."""
    outlook = forecast_flow(case)
    return Size(outlook.seconds, 1, BYTES_OF_PARTICLE * outlook.particles)


def flow_tables(case: FlowCase, outlook: FlowForecast) -> Iterator[RenderableType]:
    """Yield particles, speeds and time steps."""
    scene: SphFlow = case.scene
    table = new_table("\nFlow", "what", "value", "remark")
    unit = "um" if isinstance(scene, Droplet | Printing) else "mm"
    spacing = f"{from_si(outlook.spacing, unit, digits=3)} spacing at the start"
    table.add_row("particles", f"{outlook.particles}", spacing)
    numbers = f"of {from_si(scene.length, unit, digits=3)} and {from_si(scene.fastest, 'm/s', digits=3)}"
    table.add_row("Reynolds number", f"{scene.reynolds_number:.3g}", numbers)
    ratio = f"{scene.numerics.sound_speed:g} times the largest speed expected"
    table.add_row("speed of sound", from_si(scene.sound, "m/s", digits=3), ratio)
    table.add_row("time step", short(outlook.time_step), f"{outlook.steps} steps for {short(scene.until)}")
    _add_devices(table, outlook, 3 if isinstance(scene, Droplet | Printing) else 2)
    if isinstance(scene, Droplet):
        _add_droplet(table, scene)
    if isinstance(scene, Printing):
        _add_droplet(table, scene.drop)
        _add_printing(table, scene)
    if isinstance(scene, DamBreak):
        table.add_row("unit of time", short(scene.unit_of_time), "sqrt(H / g)")
    if isinstance(scene, TaylorGreen):
        table.add_row("exact solution", "Taylor & Green", "the largest speed dies out by exp(-8 pi² nu t / L²)")
    yield table


def _add_devices(table: Table, outlook: FlowForecast, dimension: int) -> None:
    """Add the cost on each device, and how many particles take a day there: steps grow as spacings shrink."""
    names = {"cpu": "on one core", "cuda": "on a GPU"}
    for device, cost in outlook.by_device.items():
        low, high = -9.0, 9.0  # powers of ten: how many times the particles take a day
        while high - low > 0.01:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if cost.finer(10.0**middle, dimension).seconds < DAY else (low, middle)
        limit = f"a day for about {outlook.particles * 10.0**low:.1g} particles"
        if cost.seconds > DAY:
            limit += ": a GPU or a coarser spacing is needed" if device == "cpu" else ": a coarser spacing is needed"
        table.add_row(names[device], f"about {duration(cost.seconds)}", limit)


def _add_droplet(table: Table, scene: Droplet) -> None:
    """Add a droplet's numbers, and what is known of its end."""
    table.add_row("Ohnesorge number", f"{scene.ohnesorge:.3g}", "viscosity over surface tension")
    if scene.impact_speed:
        table.add_row("Weber number", f"{scene.weber_number:.3g}", from_si(scene.impact_speed, "m/s", digits=3))
    unit = "D / U" if scene.impact_speed else "sqrt(rho D^3 / gamma)"
    table.add_row("unit of time", short(scene.unit_of_time), unit)
    if scene.has_wall:
        base, height = cap(scene.angle)
        table.add_row("cap at rest", f"{base:.3f} x {height:.3f} D", "width on the wall and height, without weight")
    else:
        table.add_row("pressure at rest", from_si(scene.laplace_pressure, "Pa", digits=4), "4 gamma / D")


def _add_printing(table: Table, scene: Printing) -> None:
    """Add what is printed, and how it cures or freezes."""
    pattern = f"{scene.columns} x {scene.rows} in {scene.layers} layer{'s' if scene.layers > 1 else ''}"
    table.add_row("drops", f"{scene.drops}", pattern)
    base = f"{scene.pitch / scene.base:.3g} times the width of a drop on the plate, {micrometres(scene.base)}"
    table.add_row("pitch", micrometres(scene.pitch), base)
    wet = "before the next drop lands" if scene.cure_time <= scene.delay else "after the next drop has landed"
    table.add_row("frozen after" if scene.freezes else "cured after", short(scene.cure_time), wet)
    rests = "until it is solid" if scene.freezes else "of each drop; what is then liquid rests until it is cured"
    table.add_row("followed", short(scene.followed), rests)
