"""A joint whose neck has collapsed becomes two drops, one on each pad."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.scenes.metrics import Metrics, particle_pressure
from reflowshock.particles.scenes.rebuild import closed_surface
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run, StopRule, run_to_rest
from reflowshock.particles.steps.shape import JointShape, numbered_on, together
from reflowshock.particles.surface.cloud_level_set import cloud_from_level_set
from reflowshock.particles.surface.level_set import Grid, LevelSet, signed_distance
from reflowshock.particles.surface.profile import Profile, fit_profile

# A neck nearer to a plate than this leaves no drop there that particles could fill.
FEWEST_SPACINGS = 2.0
KEPT_METRICS = ("volume", "volume_drift", "standoff", "steps", "seconds", "time_step_over_capillary_limit")

Flowed = tuple[LiquidFlow, Run]


def split_to_rest(flow: LiquidFlow, rule: StopRule, start: Callable[[Body], LiquidFlow]) -> list[Flowed]:
    """Cut a body between two horizontal plates at its neck and let both drops come to rest.

    Args:
        flow: of the body, with one contact line on each plate.
        rule: when a drop is at rest.
        start: makes the flow of a drop.

    Returns:
        The flow and run of the drop on the lower plate and of that under the upper one; none where the neck is at a
        plate, or a plate is tilted.
    """
    body, lines = flow.body, flow.physics.lines
    walls = tuple(replace(plate, pads=line.pads) for plate, line in zip(body.plates, lines, strict=True))
    profile, room = fit_profile(body.points, body.triangles, body.span()), FEWEST_SPACINGS * body.cloud.spacing
    neck, below = _neck(profile)
    if any(plate.normal[2] != 1.0 or abs(neck - plate.origin[2]) < room for plate in walls):
        return []
    drops = [start(part) for part in _cut(body, walls, neck, below)]
    return [(drop, run_to_rest(drop, rule)) for drop in drops]


def _neck(profile: Profile) -> tuple[float, float]:
    """Height of the thinnest section [m], and the share of the volume below it."""
    thinnest = int(profile.radius.argmin())
    slices = 0.5 * (profile.radius[1:] ** 2 + profile.radius[:-1] ** 2)
    return float(profile.z[thinnest]), float(slices[:thinnest].sum() / slices.sum())


def _cut(body: Body, walls: tuple[Plate, ...], neck: float, below: float) -> tuple[Body, Body]:
    """What is below and above the neck, with new particles; together they have the body's volume."""
    volume = body.volume()[0]
    grid = Grid.around(body.points, body.cloud.spacing, [plate.origin[2] for plate in walls])
    values, heights = signed_distance(*closed_surface(body), grid).values, grid.axes()[2]
    lower = LevelSet(grid, np.maximum(values, heights - neck))
    upper = LevelSet(grid, np.maximum(values, neck - heights))
    return (
        Body.at_rest(cloud_from_level_set(lower, below * volume, walls[:1])),
        Body.at_rest(cloud_from_level_set(upper, (1.0 - below) * volume, walls[1:])),
    )


def parted_shape(joint: JointShape, drops: Sequence[Flowed]) -> JointShape:
    """The shape of an open joint: both drops at rest, with the history of the joint until its neck collapsed.

    Args:
        joint: when its neck collapsed.
        drops: what `split_to_rest` returned.
    """
    bodies = [flow.body for flow, _ in drops]
    counts = [body.cloud.surface_count for body in bodies]
    points = together([body.points for body in bodies], counts)
    kept = {name: number for name, number in joint.metrics.items() if name in KEPT_METRICS}
    return replace(
        joint,
        points=points,
        velocity=together([body.velocity for body in bodies], counts),
        pressure=together([particle_pressure(flow) for flow, _ in drops], counts),
        surface_points=points[: sum(counts)],
        triangles=np.concatenate(numbered_on([body.triangles for body in bodies], counts)),
        rings=tuple(numbered_on([body.cloud.rings[0] for body in bodies], counts)),
        metrics=kept | _drop_metrics(drops),
    )


def _drop_metrics(drops: Sequence[Flowed]) -> Metrics:
    """Volume and height of each drop, and what an array is judged by."""
    metrics: Metrics = {
        "max_width": (max(run.profiles[-1].max_width for _, run in drops), "m"),
        "axial_force": (0.0, "N"),
        "particles": (float(sum(len(flow.body.points) for flow, _ in drops)), ""),
    }
    for name, (flow, run) in zip(("board", "package"), drops, strict=True):
        metrics[f"volume_{name}"] = (flow.body.volume()[0], "m^3")
        metrics[f"drop_height_{name}"] = (run.records[-1].height, "m")
    return metrics
