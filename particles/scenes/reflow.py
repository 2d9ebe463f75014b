"""Reflow of one joint: from the wetted discs, the gap and the solder to the shape at rest.

It starts from a shape far from rest and keeps the volume by one global constraint. It is quasi-static unless the
process is short against the slowest time of the body. Solder on the mask moves its wetted disc off the pad; the gap
stays that of the pads' centres. Drops on a wall come to rest up to Bond numbers of about 15, or 10 where they hardly
wet it; flatter puddles do not.
"""

from collections.abc import Callable
from dataclasses import replace
from math import pi
from pkgutil import resolve_name

import numpy as np

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.cloud import Cloud, TooLittleSolder, box_cloud, joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import Pad
from reflowshock.particles.core.symmetry import whole_line
from reflowshock.particles.parameters.effects import AT_REST, LIQUID_EFFECTS, decide_effects, switched
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.operators import Mass
from reflowshock.particles.physics.physics import Acting, Physics
from reflowshock.particles.physics.plate_motion import Travel
from reflowshock.particles.scenes.metrics import Metrics, joint_metrics, open_metrics, particle_pressure, verdict
from reflowshock.particles.scenes.rebuild import parted_shape, split_to_rest
from reflowshock.particles.scenes.step_methods import start_solver
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run, StopRule, run_to_rest
from reflowshock.particles.steps.shape import JointShape, Snapshot
from reflowshock.particles.steps.time_step import TimeStep, capillary_limit, largest_step, most_steps, swing_period
from reflowshock.particles.surface.contact_line import ContactLine

__all__ = ["JointGeometry", "JointShape", "solve_joint"]

CALM_CAPILLARY_TIMES = 20.0
FEWEST_PER_EDGE = 5


def solve_joint(
    geometry: JointGeometry,
    solder: Solder,
    progress: Callable[[float], None] | None = None,
    on_snapshot: Callable[[Snapshot], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> JointShape:
    """Let molten solder flow between two wetted discs until it is at rest.

    The solder starts as a double cone of its volume on both discs and flows by its effects (`decide_effects`). Too
    little for such a cone is a drop on the board's disc; the joint is open. So is one whose neck collapses: a drop on
    each disc.

    Args:
        geometry: gap and radii of the discs [m].
        solder: volume, fluid and process.
        progress: called with the fraction done.
        on_snapshot: called with each new snapshot.
        checkpoint: where the run continues from, to the last bit, and leaves its state.

    Raises:
        TooLittleSolder: no cone of the volume spans the gap, though a drop would reach the other disc.
        NotAtRest: no rest within `solder.numerics.max_steps`.
        SolveFailed: a linear solve failed.
    """
    try:
        flow, rule = start_joint(geometry, solder)
    except TooLittleSolder:
        flow, rule = _start_on_board(geometry, solder)
    run = run_to_rest(flow, rule, progress, on_snapshot, checkpoint)
    if len(flow.body.cloud.rings) == 1:
        return _open_shape(geometry, solder, flow, run)
    shape = joint_shape(geometry, solder, flow, run)
    return parted(geometry, solder, flow, shape) if run.ruptured else shape


def parted(geometry: JointGeometry, solder: Solder, flow: LiquidFlow, shape: JointShape) -> JointShape:
    """Return a drop at rest on each pad for a joint with a collapsed neck; the shape itself if that fails."""
    effects = switched(decide_effects(geometry, solder))
    if solder.numerics.scheme != "ispg":
        effects |= AT_REST

    def start(body: Body) -> LiquidFlow:
        drop = start_flow(body.cloud, solder, effects, pad_lines(body.cloud, solder))
        drop.physics = replace(drop.physics, motions=_taken_along(body, flow))
        return drop

    drops = split_to_rest(flow, stop_rule(flow.body.cloud, solder, effects), start)
    return parted_shape(shape, solder, drops) if drops else shape


def _taken_along(drop: Body, flow: LiquidFlow) -> tuple[Travel, ...]:
    """Motions of the plate of a drop that a joint has left on it."""
    side, plates = drop.plates[0].side, flow.body.plates
    moved = (motion for motion in flow.physics.motions if isinstance(motion, Travel))
    return tuple(replace(motion, wall=0) for motion in moved if plates[motion.wall].side == side)


def _start_on_board(geometry: JointGeometry, solder: Solder) -> tuple[LiquidFlow, StopRule]:
    """Set up the flow of a drop on the board's disc alone."""
    edge = float(np.cbrt(solder.volume))
    cloud = box_cloud(edge, max(FEWEST_PER_EDGE, 1 + round(edge / solder.numerics.spacing)))
    effects = switched(decide_effects(geometry, solder))
    lines = (contact_line(cloud, 0, geometry.radius_board, solder),)
    return start_flow(cloud, solder, effects, lines), stop_rule(cloud, solder, effects)


def _open_shape(geometry: JointGeometry, solder: Solder, flow: LiquidFlow, run: Run) -> JointShape:
    """Collect the result of a joint whose solder stays on the board."""
    height = run.records[-1].height
    if height >= geometry.gap:
        raise TooLittleSolder(f"a drop of {height:.4g} m reaches across the gap of {geometry.gap:.4g} m, no joint does")
    return replace(collect_shape(solder, flow, run, open_metrics(geometry, solder, flow, run)), verdict="open")


def start_joint(geometry: JointGeometry, solder: Solder) -> tuple[LiquidFlow, StopRule]:
    """Set up the flow of a joint from its double cone, with the effects that are called for, and when it ends."""
    cloud = joint_cloud(geometry, solder.volume, solder.numerics.spacing)
    effects = switched(decide_effects(geometry, solder))
    return joint_flow(cloud, geometry, solder), stop_rule(cloud, solder, effects)


def joint_flow(cloud: Cloud, geometry: JointGeometry, solder: Solder) -> LiquidFlow:
    """Set up the flow of a cloud that fills a joint, with the effects that are called for."""
    radii = (geometry.radius_board, geometry.radius_package)
    lines = tuple(contact_line(cloud, wall, radius, solder) for wall, radius in enumerate(radii))
    return start_flow(cloud, solder, switched(decide_effects(geometry, solder)), lines)


def contact_line(cloud: Cloud, wall: int, radius: float, solder: Solder) -> ContactLine:
    """Set up the contact line around one pad, at the plate's origin, with its radius [m]."""
    ring, pad = cloud.rings[wall], Pad((0.0, 0.0), radius, solder.pad_contact_angle)
    local = cloud.plates[wall].local(cloud.points[ring])
    corners = len(whole_line(cloud, len(ring))[0])
    return ContactLine(wall, (pad,), solder.mask_contact_angle, local, np.array([corners]))


def pad_lines(cloud: Cloud, solder: Solder) -> tuple[ContactLine, ...]:
    """Set up the contact lines of a remeshed body, on plates with pads."""
    lines = []
    for wall, (ring, plate) in enumerate(zip(cloud.rings, cloud.plates, strict=True)):
        corners = np.array([pad.corners(cloud.spacing) for pad in plate.pads])
        local = plate.local(cloud.points[ring])
        lines.append(ContactLine(wall, plate.pads, solder.mask_contact_angle, local, corners))
    return tuple(lines)


def start_flow(cloud: Cloud, solder: Solder, effects: dict[str, bool], lines: tuple[ContactLine, ...]) -> LiquidFlow:
    """Set up a flow from rest, with only the effects that are on."""
    largest, bound = largest_step(solder, cloud.spacing)
    time_step = TimeStep(largest, cloud.spacing, largest, bound, bound)
    solver, physics = start_solver(solder, effects, build_physics(solder, effects, lines))
    return LiquidFlow(Body.at_rest(cloud), physics, time_step, solver)


def stop_rule(cloud: Cloud, solder: Solder, effects: dict[str, bool], angle: float | None = 0.5 * pi) -> StopRule:
    """When a reflow ends: at rest, or with inertia at the end of the process at the latest.

    Args:
        cloud: particles.
        solder: all of it, fluid and numerics.
        effects: name to on or off.
        angle: contact angle of the cap that swings as the body does [rad]: that of a drop on a uniform wall; None for
            one without walls. Where edges or friction hold the liquid it swings about as fast as half a ball, or not.
    """
    calm_time = CALM_CAPILLARY_TIMES * capillary_limit(solder.density, cloud.spacing, solder.surface_tension)
    steps, tolerance = most_steps(solder, cloud.spacing), solder.numerics.tolerance
    if not effects["inertia"]:
        return StopRule(steps, tolerance, calm_time)
    return StopRule(steps, tolerance, calm_time, solder.process_time, 0.25 * swing_period(solder, angle))


def build_physics(solder: Solder, effects: dict[str, bool], lines: tuple[ContactLine, ...]) -> Physics:
    """Collect the effects that are on.

    Args:
        solder: fluid properties.
        effects: name to on or off, as `decide_effects` decides.
        lines: contact lines.
    """
    physics = Physics((), (Mass(solder.density),), (), (), lines)
    for effect in LIQUID_EFFECTS:
        if effects[effect.name]:
            acting: type[Acting] = resolve_name(effect.implementation)
            physics = acting.added_to(physics, solder)
    return physics


def joint_shape(geometry: JointGeometry, solder: Solder, flow: LiquidFlow, run: Run) -> JointShape:
    """Collect the result of a run that ended with the plates at a geometry."""
    return collect_shape(solder, flow, run, joint_metrics(geometry, solder, flow, run))


def collect_shape(solder: Solder, flow: LiquidFlow, run: Run, metrics: Metrics) -> JointShape:
    """Collect the result of a run."""
    body = flow.body.whole()
    return JointShape(
        points=body.points,
        velocity=body.velocity,
        pressure=particle_pressure(flow),
        surface_points=body.points[: body.cloud.surface_count],
        triangles=body.triangles,
        rings=body.cloud.rings,
        history=run.history(solder.viscosity / solder.surface_tension),
        snapshots=run.snapshots,
        metrics=metrics,
        verdict=verdict(flow.physics.lines, run.ruptured),
    )
