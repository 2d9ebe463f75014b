"""Two drops side by side that come to rest apart or merged, compared with exact shapes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf

import numpy as np

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.cloud import Cloud, box_cloud, sphere_cloud
from reflowshock.particles.core.surface_measure import centre_of_volume
from reflowshock.particles.parameters.effects import Decision, decide_drop, reference_weight, switched
from reflowshock.particles.parameters.scenes import Drops
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.reference.young_laplace import Meridian, sphere_meridian
from reflowshock.particles.scenes.drops import MovingDrop, run_drops
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow, stop_rule
from reflowshock.particles.scenes.metrics import Metrics, body_metrics, particle_pressure
from reflowshock.particles.scenes.reference_shapes import reference_drop
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run
from reflowshock.particles.steps.shape import JointShape, Snapshot, concatenate_shapes, shifted_indices
from reflowshock.particles.surface.profile import fit_profile

WORST = ("_error", "_drift", "_scatter", "_at_rest")


@dataclass(frozen=True, slots=True)
class PairAtRest:
    """Two drops at rest.

    Attributes:
        shape: Both drops, or the merged drop, as one shape.
        effects: Decision on each effect.
        reference: Exact meridian of the merged drop; None if the drops are apart.
    """

    shape: JointShape
    effects: Mapping[str, Decision]
    reference: Meridian | None


def pair_to_rest(
    scene: Drops,
    solder: Solder,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> PairAtRest:
    """Compute two drops, or the drop into which they merge, at rest.

    Args:
        scene: Volumes, distance, wall and resolution.
        solder: Fluid and process.
        progress: Function called with the fraction done, 0 to 1.
        checkpoint: File from which the run continues, to the last bit, and to which it saves its state.

    Returns:
        Both drops, or the merged drop, as one shape, decisions on the effects, and the exact meridian of the merged
        drop (None if they stay apart).

    Raises:
        NotAtRest: A drop is not at rest after ``solder.numerics.max_steps``.
        SolveFailed: A linear solve failed.
    """
    effects = decide_drop(solder, scene.is_free)
    acting = switched(effects)
    start = partial(_start, solder, acting)
    flows = [start(cloud) for cloud in start_clouds(scene)]
    angle = None if scene.is_free else solder.pad_contact_angle
    rule = stop_rule(flows[0].body.cloud, solder, acting, angle)
    drops = run_drops(flows, rule, lambda body: start(body.cloud), checkpoint, progress)
    meridians = [_reference(scene, solder, effects, drop) for drop in drops]
    results = [_drop_metrics(scene, solder, *pair) for pair in zip(drops, meridians, strict=True)]
    metrics = _worst(results) | {"drops_left": (float(len(drops)), "")}
    shape = _shape(drops, metrics, solder.viscosity / solder.surface_tension)
    return PairAtRest(shape, effects, meridians[0] if len(drops) == 1 else None)


def start_clouds(scene: Drops) -> list[Cloud]:
    """Return the clouds of both drops, side by side along x with their common centre of volume at x = 0.

    Args:
        scene: Volumes of both drops, distance of their centres [m], wall and resolution.

    Returns:
        Particles with free surface and contact line of the left drop and of the right one; both stand on the same wall.
    """
    share = scene.volume_left / scene.volume
    centres = (-(1.0 - share) * scene.distance, share * scene.distance)
    return [_moved(_cloud(scene, volume), x) for volume, x in zip(scene.volumes, centres, strict=True)]


def _cloud(scene: Drops, volume: float) -> Cloud:
    edge = float(np.cbrt(volume))
    if not scene.is_free:
        return box_cloud(edge, scene.per_edge(volume))
    radius = edge * (0.75 / np.pi) ** (1.0 / 3.0)
    return sphere_cloud(volume, max(2, round(radius / scene.spacing)))


def _moved(cloud: Cloud, x: float) -> Cloud:
    return replace(cloud, points=cloud.points + np.array([x, 0.0, 0.0]))


def _start(solder: Solder, acting: Mapping[str, bool], cloud: Cloud) -> LiquidFlow:
    """Set up the flow of a drop on a uniform wall or without one."""
    lines = tuple(contact_line(cloud, wall, inf, solder) for wall in range(len(cloud.rings)))
    return start_flow(cloud, solder, dict(acting), lines)


def _volume(scene: Drops, drop: MovingDrop) -> float:
    """Return the volume of the initial drops that merged into a drop [m^3]."""
    return sum(scene.volumes[origin] for origin in drop.origins)


def _reference(scene: Drops, solder: Solder, effects: Mapping[str, Decision], drop: MovingDrop) -> Meridian | None:
    """Return the exact meridian of one of the remaining drops."""
    volume = _volume(scene, drop)
    if scene.is_free:
        return sphere_meridian(volume, solder.surface_tension)
    drop_solder = solder.model_copy(update={"volume": volume})
    return reference_drop(drop_solder, inf, reference_weight(solder, effects))


def _drop_metrics(scene: Drops, solder: Solder, drop: MovingDrop, reference: Meridian | None) -> Metrics:
    """Return the metrics of one of the remaining drops, for a sphere with the largest relative error of a radius."""
    body = drop.flow.body
    profile = fit_profile(body.points, body.triangles, body.span())
    run = Run(records=drop.records, profiles=[profile], seconds=drop.seconds, calm=drop.calm, at_rest=drop.at_rest)
    drop_solder = solder.model_copy(update={"volume": _volume(scene, drop)})
    metrics = body_metrics(drop_solder, reference, drop.flow, run)
    if not scene.is_free or reference is None:
        return metrics
    surface = body.points[: body.cloud.surface_count]
    radius = np.linalg.norm(surface - centre_of_volume(surface, body.triangles), axis=1)
    return metrics | {"radius_error": (float(np.abs(radius / (0.5 * reference.height) - 1.0).max()), "")}


def _worst(results: Sequence[Metrics]) -> Metrics:
    """Return the metrics of the first drop, with the largest errors of all drops."""
    worst = dict(results[0])
    for name, (_, unit) in worst.items():
        if name.endswith(WORST):
            worst[name] = (max((result[name][0] for result in results), key=abs), unit)
    return worst


def _shape(drops: Sequence[MovingDrop], metrics: Metrics, capillary: float) -> JointShape:
    """Combine the remaining drops in one shape, with the history of the first; ``capillary`` is mu / gamma."""
    bodies = [drop.flow.body for drop in drops]
    counts = [body.cloud.surface_count for body in bodies]
    points = concatenate_shapes([body.points for body in bodies], counts)
    return JointShape(
        points=points,
        velocity=concatenate_shapes([body.velocity for body in bodies], counts),
        pressure=concatenate_shapes([particle_pressure(drop.flow) for drop in drops], counts),
        surface_points=points[: sum(counts)],
        triangles=np.concatenate(shifted_indices([body.triangles for body in bodies], counts)),
        rings=(),
        history=Run(records=drops[0].records).history(capillary),
        snapshots=_stages(drops),
        metrics=metrics,
        verdict="merged" if drops[0].parents else "apart",
    )


def _stages(drops: Sequence[MovingDrop]) -> list[Snapshot]:
    """Return the initial state and, if the drops merged, the states before and after."""
    if not drops[0].parents:
        return [_side_by_side([drop.first for drop in drops])]
    parents = drops[0].parents
    before = [_side_by_side([parent.first for parent in parents])]
    if any(parent.records for parent in parents):
        before.append(_side_by_side([_now(parent) for parent in parents]))
    return [*before, drops[0].first]


def _now(drop: MovingDrop) -> Snapshot:
    return Snapshot(drop.flow.time, drop.flow.body.points, drop.flow.body.triangles)


def _side_by_side(states: Sequence[Snapshot]) -> Snapshot:
    """Combine the snapshots of several drops into one."""
    triangles = shifted_indices([state.triangles for state in states], [len(state.points) for state in states])
    points = np.concatenate([state.points for state in states])
    return Snapshot(max(state.time for state in states), points, np.concatenate(triangles))
