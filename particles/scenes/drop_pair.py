"""Two drops side by side: from their start to rest as one drop or two, against exact shapes."""

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
from reflowshock.particles.scenes.metrics import Metrics, body_metrics, particle_pressure, reference_drop
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run
from reflowshock.particles.steps.shape import JointShape, Snapshot, concatenated, shifted_indices
from reflowshock.particles.surface.profile import fit_profile

WORST = ("_error", "_drift", "_scatter", "_at_rest")


@dataclass(frozen=True, slots=True)
class PairAtRest:
    """Both drops at rest as one shape, the effects that acted, and the exact meridian of the one they became."""

    shape: JointShape
    effects: Mapping[str, Decision]
    reference: Meridian | None


def pair_to_rest(
    scene: Drops,
    solder: Solder,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> PairAtRest:
    """Let two drops flow until they, or the one that they became, are at rest.

    Args:
        scene: volumes, place, wall and resolution.
        solder: their fluid and process.
        progress: called with the fraction done.
        checkpoint: where the run continues from, to the last bit, and leaves its state.

    Raises:
        NotAtRest: a drop is not at rest within `solder.numerics.max_steps`.
        SolveFailed: a linear solve failed.
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
    """Clouds of both drops, side by side along x with their common centre of volume at x = 0."""
    share = scene.volume_left / scene.volume
    places = (-(1.0 - share) * scene.distance, share * scene.distance)
    return [_moved(_cloud(scene, volume), x) for volume, x in zip(scene.volumes, places, strict=True)]


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
    """Volume that a drop is made of [m^3]."""
    return sum(scene.volumes[origin] for origin in drop.origins)


def _reference(scene: Drops, solder: Solder, effects: Mapping[str, Decision], drop: MovingDrop) -> Meridian | None:
    """Exact meridian of one of the drops that are left."""
    volume = _volume(scene, drop)
    if scene.is_free:
        return sphere_meridian(volume, solder.surface_tension)
    own = solder.model_copy(update={"volume": volume})
    return reference_drop(own, inf, reference_weight(solder, effects))


def _drop_metrics(scene: Drops, solder: Solder, drop: MovingDrop, reference: Meridian | None) -> Metrics:
    """Numbers of one of the drops that are left; of a sphere also the largest error of a radius."""
    body = drop.flow.body
    profile = fit_profile(body.points, body.triangles, body.span())
    run = Run(records=drop.records, profiles=[profile], seconds=drop.seconds, calm=drop.calm, at_rest=drop.at_rest)
    own = solder.model_copy(update={"volume": _volume(scene, drop)})
    metrics = body_metrics(own, reference, drop.flow, run)
    if not scene.is_free or reference is None:
        return metrics
    surface = body.points[: body.cloud.surface_count]
    radius = np.linalg.norm(surface - centre_of_volume(surface, body.triangles), axis=1)
    return metrics | {"radius_error": (float(np.abs(radius / (0.5 * reference.height) - 1.0).max()), "")}


def _worst(results: Sequence[Metrics]) -> Metrics:
    """Numbers of the first drop, but the largest error of all."""
    worst = dict(results[0])
    for name, (_, unit) in worst.items():
        if name.endswith(WORST):
            worst[name] = (max((result[name][0] for result in results), key=abs), unit)
    return worst


def _shape(drops: Sequence[MovingDrop], metrics: Metrics, capillary: float) -> JointShape:
    """Combine the remaining drops in one shape, with the history of the first; ``capillary`` is mu / gamma."""
    bodies = [drop.flow.body for drop in drops]
    counts = [body.cloud.surface_count for body in bodies]
    points = concatenated([body.points for body in bodies], counts)
    return JointShape(
        points=points,
        velocity=concatenated([body.velocity for body in bodies], counts),
        pressure=concatenated([particle_pressure(drop.flow) for drop in drops], counts),
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
    """States of several drops as one."""
    triangles = shifted_indices([state.triangles for state in states], [len(state.points) for state in states])
    points = np.concatenate([state.points for state in states])
    return Snapshot(max(state.time for state in states), points, np.concatenate(triangles))
