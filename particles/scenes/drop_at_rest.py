"""Single drop at rest: free, on a uniform wall with or without hysteresis, or on a pad in the mask.

The drop starts as a cube, or for an impact as a sphere that touches the wall.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.cloud import Cloud, box_cloud, free_box_cloud
from reflowshock.particles.core.symmetry import cut
from reflowshock.particles.parameters.effects import Decision, decide_drop, reference_weight, switched
from reflowshock.particles.parameters.scenes import Drop
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.reference.young_laplace import Meridian, sessile_meridian, sessile_section, sphere_meridian
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow, stop_rule
from reflowshock.particles.scenes.metrics import Metrics, body_metrics, with_shape_error
from reflowshock.particles.scenes.reference_shapes import reference_drop
from reflowshock.particles.scenes.reflow import collect_shape
from reflowshock.particles.scenes.section_drop import start_section
from reflowshock.particles.section.section import Section
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run, StopRule, run_to_rest
from reflowshock.particles.steps.shape import JointShape
from reflowshock.particles.surface.contact_line import ContactLine
from reflowshock.particles.surface.hysteresis import FrictionLine, HystereticLine
from reflowshock.particles.surface.profile import mean_width

ANGLE_OF_CUBE = 0.5 * np.pi
# Contact angle of the initial cap of an impact: at 160 degrees particles slip out between surface and wall.
TOUCHING_ANGLE = float(np.radians(155.0))
TOUCHING_STEP = 100.0  # time step that deforms the cube to this cap, in capillary limits


@dataclass(frozen=True, slots=True)
class DropAtRest:
    """Drop at rest.

    Attributes:
        shape: Particles, surface, history and metrics.
        effects: Decision on each effect.
        reference: Exact meridian; None if the drop has none.
    """

    shape: JointShape
    effects: Mapping[str, Decision]
    reference: Meridian | None


def drop_to_rest(
    drop: Drop,
    solder: Solder,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> DropAtRest:
    """Compute a drop at rest and compare it with its exact shape.

    Args:
        drop: Scene of the drop: volume, wall, resolution and initial motion.
        solder: Fluid and process, with the volume of the drop.
        progress: Function called with the fraction done, 0 to 1.
        checkpoint: File from which the run continues, to the last bit, and to which it saves its state.

    Returns:
        Shape with history and metrics, decisions on the effects, and exact meridian (None without one).

    Raises:
        NotAtRest: The drop is not at rest after ``solder.numerics.max_steps``.
        SolveFailed: A linear solve failed.
    """
    effects = decide_drop(solder, drop.is_free)
    flow, run = flow_to_rest(drop, solder, progress, checkpoint)
    # With hysteresis an oscillation ends at any angle between the receding and the advancing one.
    is_arbitrary = drop.hysteresis is not None and effects["inertia"]["on"]
    is_known = drop.is_free or (effects["wall_adhesion"]["on"] and not is_arbitrary)
    weight = reference_weight(solder, effects)
    reference = _reference(drop, solder, weight) if is_known and weight is not None else None
    metrics = body_metrics(solder, reference, flow, run)
    shape = collect_shape(solder, flow, run, metrics | _excess(drop, metrics) | _spread(drop, run))
    surface = flow.body.narrow() if isinstance(flow.body, Section) else flow.body
    return DropAtRest(with_shape_error(shape, solder, reference, surface), effects, reference)


def flow_to_rest(
    drop: Drop,
    solder: Solder,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> tuple[LiquidFlow, Run]:
    """Return the flow of a drop at rest and the records of its steps.

    Args:
        drop: Volume, wall, resolution and initial motion; it may be a section, or a part cut by planes of symmetry.
        solder: Fluid and process, with the volume of the drop.
        progress: Function called with the fraction done, 0 to 1.
        checkpoint: File from which the run continues, to the last bit, and to which it saves its state.

    Returns:
        Final flow (body, physics, time), and its run with a record and a profile for each step.

    Raises:
        NotAtRest: The drop is not at rest after ``solder.numerics.max_steps``.
        SolveFailed: A linear solve failed.
    """
    acting = switched(decide_drop(solder, drop.is_free))
    if drop.section != "none":
        section = start_section(drop, solder, acting)
        return section, run_to_rest(section, _rule(drop, section.body.cloud, solder), progress, checkpoint=checkpoint)
    whole = free_box_cloud(drop.edge, drop.count) if drop.is_free else box_cloud(drop.edge, drop.count)
    cloud = cut(whole, drop.symmetry_axes)
    if drop.speed is not None:
        cloud = _touching(cloud, solder)
    flow = start_flow(cloud, solder, acting, _contact_lines(drop, solder, cloud))
    if drop.speed is not None:
        flight = np.broadcast_to([0.0, 0.0, -drop.speed], cloud.points.shape)
        flow.body.velocity = flow.physics.admit(flow.body, flight)
    return flow, run_to_rest(flow, _rule(drop, cloud, solder), progress, checkpoint=checkpoint)


def _rule(drop: Drop, cloud: Cloud, solder: Solder) -> StopRule:
    """Return the stop rule: a drop oscillates as the cap at rest, unless an edge or friction holds its contact line."""
    acting = switched(decide_drop(solder, drop.is_free))
    if drop.is_free:
        return stop_rule(cloud, solder, acting, None)
    if drop.pad_radius is not None or drop.hysteresis is not None:
        return stop_rule(cloud, solder, acting)
    return stop_rule(cloud, solder, acting, solder.pad_contact_angle)


def _touching(cloud: Cloud, solder: Solder) -> Cloud:
    """Deform a cube on a wall into a sphere that just touches the wall."""
    numerics = solder.numerics.model_copy(update={"scheme": "energy", "time_step_limit": TOUCHING_STEP})
    still = solder.model_copy(update={"numerics": numerics, "pad_contact_angle": TOUCHING_ANGLE})
    acting = {"surface_tension": True, "wall_adhesion": True}
    flow = start_flow(cloud, still, acting, (contact_line(cloud, 0, np.inf, still),))
    run_to_rest(flow, stop_rule(cloud, still, acting))
    return replace(cloud, points=flow.body.points, triangles=flow.body.triangles)


def _spread(drop: Drop, run: Run) -> Metrics:
    """Return the largest width of an impacting drop over its diameter, and its time."""
    if drop.speed is None:
        return {}
    widths = [mean_width(snapshot.points) for snapshot in run.snapshots]
    widest = int(np.argmax(widths))
    return {"spread_max": (widths[widest] / drop.diameter, ""), "time_of_spread_max": (run.snapshots[widest].time, "s")}


def _contact_lines(drop: Drop, solder: Solder, cloud: Cloud) -> tuple[ContactLine, ...]:
    if drop.is_free:
        return ()
    if drop.hysteresis is None:
        return (contact_line(cloud, 0, drop.edge_radius, solder),)
    line = FrictionLine if solder.numerics.scheme == "ispg" else HystereticLine
    return (line(0, *drop.hysteresis, cloud.plates[0].local(cloud.points[cloud.rings[0]])),)


def _reference(drop: Drop, solder: Solder, weight: float) -> Meridian | None:
    """Return the exact meridian; with hysteresis only if the line advances from the 90 degrees of the cube."""
    if drop.is_free:
        return sphere_meridian(solder.volume, solder.surface_tension)
    if drop.section == "plane":
        return sessile_section(drop.edge**2, solder.pad_contact_angle, solder.surface_tension, weight)
    if drop.hysteresis is None:
        return reference_drop(solder, drop.edge_radius, weight)
    if drop.hysteresis[1] >= ANGLE_OF_CUBE:
        return None
    return sessile_meridian(solder.volume, drop.hysteresis[1], solder.surface_tension, weight)


def _excess(drop: Drop, metrics: Metrics) -> Metrics:
    """Return the largest excess of contact angles beyond the receding and advancing angles [deg]."""
    if drop.hysteresis is None:
        return {}
    receding, advancing = np.degrees(drop.hysteresis)
    below, above = receding - metrics["contact_angle_min"][0], metrics["contact_angle_max"][0] - advancing
    return {"contact_angle_excess": (float(np.max([0.0, below, above])), "deg")}
