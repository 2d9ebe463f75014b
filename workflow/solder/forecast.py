"""Effects, size and cost of the reflow of solder alone, and its table of the plan."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import ceil
from typing import Any

from rich.console import RenderableType

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.forecast import BYTES_OF_PARTICLE, Size
from reflowshock.workflow.case.text import short
from reflowshock.workflow.process.terminal import REFLOW_SPEED, new_table, styled
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase, SolderCase

SCHEMES = {
    "energy": "minimum energy of the tracked surface at constant volume",
    "inertia": "moving tetrahedra, second order in space and time; cost of the maximum number of steps",
    "ispg": "Galerkin form of the paper's method, second order in time; cost of the maximum number of steps",
    "gripc": "pressure correction of Hu et al., for comparison only; its steps are not part of the predicted cost",
}


SECONDS_TO_START = 2.0  # until a stage has loaded its libraries and kernels


@dataclass(frozen=True, slots=True)
class SolderForecast:
    """What the reflow of one body will be like.

    Attributes:
        effects: effect -> {"on", "why"}.
        particles: number of particles.
        scheme: how steps are solved.
        why: why so, where the case leaves it open.
        spacing: their distance at the start [m].
        capillary_limit: largest stable time step of an explicit surface tension [s].
        largest_step: largest time step that will be taken [s].
        seconds: stage -> predicted wall time [s].
    """

    effects: Mapping[str, Any]
    particles: int
    scheme: str
    spacing: float
    capillary_limit: float
    largest_step: float
    seconds: dict[str, float]
    why: str = ""


def forecast_solder(case: Case) -> SolderForecast:
    """Predict effects, size, time step and cost of a scene of solder alone."""
    return FORECASTS[case.kind](case)


def _of_drop(case: DropCase) -> SolderForecast:
    from reflowshock.particles.parameters.effects import decide_drop
    from reflowshock.particles.parameters.estimate import drop_seconds, section_seconds

    drop = case.drop
    effects = decide_drop(case.molten, drop.is_free)
    if drop.section == "none":
        return _towards_rest(case, effects, drop.particles, drop_seconds(drop.particles))
    return _towards_rest(case, effects, drop.particles, 0.0, section_seconds)


def _of_joint(case: JointCase) -> SolderForecast:
    from reflowshock.particles.parameters.effects import decide_effects
    from reflowshock.particles.parameters.estimate import ispg_seconds, particle_count, reflow_seconds

    geometry, solder = case.joint.geometry, case.molten
    particles = particle_count(solder, geometry)
    seconds = (1 + len(case.joint.places)) * reflow_seconds(solder, geometry)
    found, path = _towards_rest(case, decide_effects(geometry, solder), particles, seconds), case.joint.path
    if path is None or path.speed is None:
        return found
    on_the_way = ispg_seconds(particles, ceil(case.joint.way / path.speed / found.largest_step))
    return replace(found, seconds={"reflow": 2.0 * found.seconds["reflow"] + on_the_way})  # at rest before and after


def _of_drops(case: DropsCase) -> SolderForecast:
    from reflowshock.particles.parameters.effects import decide_drop
    from reflowshock.particles.parameters.estimate import drop_seconds

    drops = case.drops
    merged = (drops.volume,) if drops.merge else ()
    flowing = merged if drops.is_free and drops.merge else (*drops.volumes, *merged)  # free ones touch at once
    seconds = sum(drop_seconds(drops.per_edge(volume) ** 3) for volume in flowing)
    return _towards_rest(case, decide_drop(case.molten, drops.is_free), drops.particles, seconds)


def _towards_rest(
    case: SolderCase,
    effects: Mapping[str, Any],
    particles: int,
    seconds: float,
    of_ispg: Callable[[int, int], float] | None = None,
) -> SolderForecast:
    from reflowshock.particles.parameters.estimate import inertial_seconds, ispg_seconds
    from reflowshock.particles.steps.time_step import capillary_limit, largest_step, most_steps

    solder = case.molten
    numerics = solder.numerics
    limit = capillary_limit(solder.density, numerics.spacing, solder.surface_tension)
    largest, _ = largest_step(solder, numerics.spacing)
    scheme: str = numerics.scheme
    steps = min(most_steps(solder, numerics.spacing), ceil(solder.process_time / largest))
    if scheme == "energy" and (effects["inertia"]["on"] or effects["viscosity"]["on"]):
        scheme, seconds = "inertia", inertial_seconds(particles, steps)
    if scheme == "ispg":
        seconds = (of_ispg or ispg_seconds)(particles, steps)
    cost = {"reflow": SECONDS_TO_START + seconds}
    why = case.decided[1] if effects["inertia"]["on"] else ""
    return SolderForecast(effects, particles, scheme, numerics.spacing, limit, largest, cost, why)


def _of_oscillation(case: OscillationCase) -> SolderForecast:
    from reflowshock.particles.parameters.effects import decide_oscillation
    from reflowshock.particles.parameters.estimate import inertial_seconds, ispg_seconds
    from reflowshock.particles.parameters.scenes import rayleigh_period
    from reflowshock.particles.steps.time_step import capillary_limit

    scene, solder = case.oscillation, case.molten
    spacing = solder.numerics.spacing
    steps = ceil(scene.periods * scene.steps_per_period)
    seconds = ispg_seconds if scene.scheme == "ispg" else inertial_seconds
    return SolderForecast(
        effects=decide_oscillation(solder),
        particles=scene.particles,
        scheme=scene.scheme,
        spacing=spacing,
        capillary_limit=capillary_limit(solder.density, spacing, solder.surface_tension),
        largest_step=rayleigh_period(scene, solder) / scene.steps_per_period,
        seconds={"reflow": SECONDS_TO_START + seconds(scene.particles, steps)},
    )


FORECASTS: dict[str, Callable[[Any], SolderForecast]] = {
    DropCase.kind: _of_drop,
    JointCase.kind: _of_joint,
    DropsCase.kind: _of_drops,
    OscillationCase.kind: _of_oscillation,
}


def solder_size(case: Case) -> Size:
    """Predict what the stages of a case take."""
    outlook = forecast_solder(case)
    return Size(outlook.seconds, 1, BYTES_OF_PARTICLE * outlook.particles)


def solder_tables(case: Case, outlook: SolderForecast) -> Iterator[RenderableType]:
    """Yield particles, scheme and time steps; then what the costs assume."""
    table = new_table("\nReflow", "what", "value", "remark")
    table.add_row("particles", f"{outlook.particles}", f"{1e6 * outlook.spacing:.3g} µm spacing at the start")
    table.add_row("scheme", outlook.scheme, SCHEMES[outlook.scheme] + (f"; {outlook.why}" if outlook.why else ""))
    table.add_row(
        "capillary limit", short(outlook.capillary_limit), "largest stable time step of explicit surface tension"
    )
    ratio = outlook.largest_step / outlook.capillary_limit
    table.add_row("largest time step", short(outlook.largest_step), f"{ratio:.3g} times the limit")
    yield table
    yield styled("\n[dim]{}", REFLOW_SPEED)
