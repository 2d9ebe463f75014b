"""A free drop that swings: the flow of `free_drop.py` for a case of its own."""

from collections.abc import Callable

import numpy as np

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.parameters.scene_oscillation import Oscillation, rayleigh_period
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.free_drop import solve_free_drop
from reflowshock.particles.scenes.metrics import Metrics
from reflowshock.particles.steps.shape import JointShape
from reflowshock.particles.steps.time_step import capillary_limit

METRICS = (
    "period",
    "period_error",
    "decay_rate",
    "decay_rate_error",
    "volume_drift",
    "particles",
    "particle_steps_per_second",
)


def solve_oscillation(
    scene: Oscillation,
    solder: Solder,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> JointShape:
    """Let a drop swing: its shape at the end, history and snapshots in time.

    Args:
        scene: volume, amplitude, duration and resolution.
        solder: the same volume, and fluid.
        progress: called with the fraction done.
        checkpoint: where the run continues from, to the last bit, and leaves its state.

    Raises:
        SolveFailed: a linear solve failed.
    """
    drop = solve_free_drop(solder, scene.amplitude, scene.periods, scene.steps_per_period, progress, checkpoint)
    steps = len(drop.history["time"]) - 1
    limit = capillary_limit(solder.density, solder.numerics.spacing, solder.surface_tension)
    largest = rayleigh_period(scene, solder) / scene.steps_per_period
    metrics: Metrics = {name: drop.metrics[name] for name in METRICS}
    metrics |= {
        "amplitude": (float(np.abs(drop.history["amplitude"]).max()), ""),
        "time_step_over_capillary_limit": (largest / limit, ""),
        "steps": (float(steps), ""),
        "seconds": (steps * len(drop.points) / drop.metrics["particle_steps_per_second"][0], "s"),
    }
    return JointShape(
        points=drop.points,
        velocity=drop.velocity,
        pressure=drop.pressure,
        surface_points=drop.surface_points,
        triangles=drop.triangles,
        rings=(),
        history=drop.history,
        snapshots=drop.snapshots,
        metrics=metrics,
        verdict="ok",
    )
