"""Effects, size and cost of the reflow of one drop or joint, from its parameters alone."""

from dataclasses import dataclass

from workflow.case import DropCase, JointCase


@dataclass(frozen=True, slots=True)
class SceneForecast:
    """What the reflow of one body will be like.

    Attributes:
        effects: effect -> {"on", "why"}.
        particles: number of particles.
        scheme: how steps are solved.
        spacing: their distance at the start [m].
        capillary_limit: largest stable time step of an explicit surface tension [s].
        largest_step: largest time step that will be taken [s].
        seconds: stage -> predicted wall time [s].
    """

    effects: dict
    particles: int
    scheme: str
    spacing: float
    capillary_limit: float
    largest_step: float
    seconds: dict[str, float]


def forecast_scene(case: DropCase | JointCase) -> SceneForecast:
    """Predict effects, size, time step and cost."""
    from particles.effects import decide_drop, decide_effects
    from particles.estimate import drop_seconds, particle_count, reflow_seconds
    from particles.time_step import capillary_limit

    solder = case.molten
    if isinstance(case, DropCase):
        effects, particles = decide_drop(solder, case.drop.is_free), case.drop.count**3
        seconds = drop_seconds(case.drop.count)
    else:
        effects, particles = decide_effects(case.joint.geometry, solder), particle_count(solder, case.joint.geometry)
        seconds = reflow_seconds(solder, case.joint.geometry)
    limit = capillary_limit(solder.density, solder.numerics.spacing, solder.surface_tension)
    numerics = solder.numerics
    largest = numerics.time_step_limit * limit
    return SceneForecast(effects, particles, numerics.scheme, numerics.spacing, limit, largest, {"reflow": seconds})
