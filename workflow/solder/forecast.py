"""Forecast of the reflow of solder alone: effects, size and cost, and its table of the plan."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import ceil
from typing import Any

from rich.console import RenderableType

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.forecast import BYTES_OF_PARTICLE, Size
from reflowshock.workflow.case.text import short
from reflowshock.workflow.process.terminal import REFLOW_SPEED, new_table, style_text
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase, SolderCase

SCHEMES = {
    "energy": "minimum energy of the tracked surface at constant volume",
    "inertia": "moving tetrahedra, second order in space and time; cost of the maximum number of steps",
    "ispg": "Galerkin form of the paper's method, second order in time; cost of the maximum number of steps",
    "gripc": "pressure correction of Hu et al., for comparison only; the predicted cost does not include its steps",
}


SECONDS_TO_START = 2.0  # loading of libraries and compiled kernels


@dataclass(frozen=True, slots=True)
class SolderForecast:
    """Forecast of the reflow of one body.

    Attributes:
        effects: Effect -> {"on", "why"}.
        particles: Number of particles.
        scheme: Time integration scheme.
        spacing: Initial particle spacing [m].
        capillary_limit: Largest stable time step of explicit surface tension [s].
        largest_step: Largest expected time step [s].
        seconds: Stage -> predicted wall time [s].
        why: Reason for the scheme; empty if the case sets it.
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
    """Predict effects, size, time step and cost of a scene of solder alone, without running it.

    Args:
        case: Case of a drop, a joint, two drops or an oscillating drop.

    Returns:
        Effects, number and spacing of the particles, scheme and its reason, time steps, wall time by stage [s].
    """
    return FORECASTS[case.kind](case)


def _forecast_drop(case: DropCase) -> SolderForecast:
    from reflowshock.particles.parameters.effects import decide_drop
    from reflowshock.particles.parameters.estimate import drop_seconds, section_seconds

    drop = case.drop
    effects = decide_drop(case.molten, drop.is_free)
    if drop.section == "none":
        return _towards_rest(case, effects, drop.particles, drop_seconds(drop.particles))
    return _towards_rest(case, effects, drop.particles, 0.0, section_seconds)


def _forecast_joint(case: JointCase) -> SolderForecast:
    from reflowshock.particles.parameters.effects import decide_effects
    from reflowshock.particles.parameters.estimate import ispg_seconds, particle_count, reflow_seconds

    geometry, solder = case.joint.geometry, case.molten
    particles = particle_count(solder, geometry)
    seconds = (1 + len(case.joint.path_geometries)) * reflow_seconds(solder, geometry)
    forecast, path = _towards_rest(case, decide_effects(geometry, solder), particles, seconds), case.joint.path
    if path is None or path.speed is None:
        return forecast
    moving = ispg_seconds(particles, ceil(case.joint.path_length / path.speed / forecast.largest_step))
    return replace(forecast, seconds={"reflow": 2.0 * forecast.seconds["reflow"] + moving})  # at rest before and after


def _forecast_drops(case: DropsCase) -> SolderForecast:
    from reflowshock.particles.parameters.effects import decide_drop
    from reflowshock.particles.parameters.estimate import drop_seconds

    drops = case.drops
    merged = (drops.volume,) if drops.merge else ()
    flowing = merged if drops.is_free and drops.merge else (*drops.volumes, *merged)  # free drops touch from the start
    seconds = sum(drop_seconds(drops.per_edge(volume) ** 3) for volume in flowing)
    return _towards_rest(case, decide_drop(case.molten, drops.is_free), drops.particles, seconds)


def _towards_rest(
    case: SolderCase,
    effects: Mapping[str, Any],
    particles: int,
    seconds: float,
    ispg_cost: Callable[[int, int], float] | None = None,
) -> SolderForecast:
    """Return the forecast of a body that comes to rest.

    Args:
        case: Case of the body.
        effects: Decided effects.
        particles: Number of particles.
        seconds: Wall time of the quasi-static scheme [s].
        ispg_cost: Function of particles and steps that returns the wall time of ISPG [s].
    """
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
        seconds = (ispg_cost or ispg_seconds)(particles, steps)
    cost = {"reflow": SECONDS_TO_START + seconds}
    why = case.decided[1] if effects["inertia"]["on"] else ""
    return SolderForecast(effects, particles, scheme, numerics.spacing, limit, largest, cost, why)


def _forecast_oscillation(case: OscillationCase) -> SolderForecast:
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
    DropCase.kind: _forecast_drop,
    JointCase.kind: _forecast_joint,
    DropsCase.kind: _forecast_drops,
    OscillationCase.kind: _forecast_oscillation,
}


def solder_size(case: Case) -> Size:
    """Predict wall times and memory of the stages of a case.

    Args:
        case: Case of a drop, a joint, two drops or an oscillating drop.

    Returns:
        Seconds by stage, number of joints (1), and memory [B].
    """
    forecast = forecast_solder(case)
    return Size(forecast.seconds, 1, BYTES_OF_PARTICLE * forecast.particles)


def solder_tables(_case: Case, forecast: SolderForecast) -> Iterator[RenderableType]:
    """Yield the table of particles, scheme and time steps that ``plan`` prints, and a line on the assumed speed.

    Args:
        _case: Case of the forecast; not used.
        forecast: Forecast by ``forecast_solder``.
    """
    table = new_table("\nReflow", "quantity", "value", "remark")
    table.add_row("particles", f"{forecast.particles}", f"{1e6 * forecast.spacing:.3g} µm initial spacing")
    table.add_row("scheme", forecast.scheme, SCHEMES[forecast.scheme] + (f"; {forecast.why}" if forecast.why else ""))
    table.add_row(
        "capillary limit", short(forecast.capillary_limit), "largest stable time step of explicit surface tension"
    )
    ratio = forecast.largest_step / forecast.capillary_limit
    table.add_row("largest time step", short(forecast.largest_step), f"{ratio:.3g} times the limit")
    yield table
    yield style_text("\n[dim]{}", REFLOW_SPEED)
