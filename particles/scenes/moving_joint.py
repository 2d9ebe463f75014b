"""Joint whose package moves: it floats on the solder, or follows a path slowly or at a speed."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import ceil, degrees, hypot

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import joint_plates, placed_geometry
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.plate_motion import PlateMotion, Travel
from reflowshock.particles.scenes.metrics import Metrics
from reflowshock.particles.scenes.reflow import LiquidJoint
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import run_to_rest
from reflowshock.particles.steps.shape import JointShape

SPACINGS_PER_STEP = 0.2
ALIGNED = 0.01  # of a radius, and rad


def settle_joint(
    geometry: JointGeometry,
    solder: Solder,
    motions: Sequence[PlateMotion],
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> JointShape:
    """Compute a joint at rest between plates that move.

    Args:
        geometry: Initial position of the plates.
        solder: Volume, fluid, process and numerics; a floating plate makes the rigid motion soft, so that a
            ``time_step_limit`` of 100 is five times faster than one of 20.
        motions: Motion of each plate that does not rest: prescribed (``Travel``) or floating under a load
            (``Floating``).
        progress: Function called with the fraction done, 0 to 1.
        checkpoint: File from which the run continues, to the last bit, and to which it saves its state.

    Returns:
        Shape at rest; its metrics refer to the final position of the plates and include its offset [m] and tilt [deg].

    Raises:
        TooLittleSolder: No cone of the volume spans the gap.
        NotAtRest: The solder is not at rest after ``solder.numerics.max_steps``.
        SolveFailed: A linear solve failed.
    """
    joint = LiquidJoint(geometry, solder)
    flow = joint.start()
    flow.set_plate_motions(motions)
    run = run_to_rest(flow, joint.stop_rule(flow), progress, checkpoint=checkpoint)
    final = placed_geometry(geometry, flow.body.plates)
    shape = LiquidJoint(_aligned(final), solder).shape(flow, run)
    position = {"offset": (hypot(*final.offset), "m"), "tilt": (degrees(hypot(*final.tilt)), "deg")}
    return replace(shape, metrics=shape.metrics | position)


def _aligned(geometry: JointGeometry) -> JointGeometry:
    """Return the coaxial joint if a joint is nearly coaxial, so that an exact meridian exists."""
    radius = min(geometry.radius_board, geometry.radius_package)
    nearly = hypot(*geometry.offset) < ALIGNED * radius and hypot(*geometry.tilt) < ALIGNED
    return replace(geometry, offset=(0.0, 0.0), tilt=(0.0, 0.0)) if nearly else geometry


def follow_path(
    geometry: JointGeometry,
    solder: Solder,
    path: Sequence[JointGeometry],
    checkpoints: Callable[[int], Checkpoint] | None = None,
    speed: float | None = None,
) -> Iterator[JointShape]:
    """Move the package along a path and yield the joint at rest, at the start and at each target.

    The path ends early if the neck ruptures. Without inertia the speed has no meaning; the plate moves by a fifth of a
    spacing in the longest time step. With inertia, a package whose joint breaks carries its part of the solder to the
    target, and both parts come to rest there.

    Args:
        geometry: Initial geometry of the joint.
        solder: Volume, fluid and numerics; ``max_steps`` applies to each part of the path.
        path: Geometries of the joint at the targets, in order.
        checkpoints: Function of the number of a target (0 for the start) that returns its checkpoint.
        speed: Speed of the package with inertia [m/s]; None without inertia, for the speed above.

    Yields:
        Shape at rest at the start, then at each target; the last one has the verdict "open" if the neck ruptured.

    Raises:
        TooLittleSolder: No cone of the volume spans the initial gap.
        NotAtRest: The solder is not at rest after ``solder.numerics.max_steps``.
        SolveFailed: A linear solve failed.
    """
    start = LiquidJoint(geometry, solder)
    flow = start.start()
    rule = start.stop_rule(flow)
    for number, target in enumerate((geometry, *path)):
        motion, start_time = travel(target, flow, speed), flow.time
        steps = ceil(motion.duration(flow.body.plates[1]) / flow.time_step.largest)
        flow.set_plate_motions((motion,))
        checkpoint = checkpoints(number) if checkpoints else None
        last = replace(rule, max_steps=flow.steps + steps + rule.max_steps, end_time=start_time + rule.end_time)
        run = run_to_rest(flow, last, checkpoint=checkpoint)
        if run.ruptured:
            broken = LiquidJoint(placed_geometry(target, flow.body.plates), solder).shape(flow, run)
            yield _broken_shape(LiquidJoint(target, solder), broken, flow, flow.time - start_time)
            return
        yield LiquidJoint(target, solder).shape(flow, run)


def _broken_shape(target: LiquidJoint, broken: JointShape, flow: LiquidFlow, time: float) -> JointShape:
    """Return a joint that broke on its path, with the standoff at break; with inertia, as the two drops at rest.

    Args:
        target: Joint at the target, to which the package moves on with inertia.
        broken: Shape of the joint at break.
        flow: Flow of the joint at break.
        time: Time from the last target to the break [s].
    """
    standoff = broken.metrics["standoff"]
    metrics: Metrics = {"standoff_at_break": standoff}
    if not flow.physics.momenta:
        return replace(broken, metrics=broken.metrics | metrics)
    shape = target.split(flow, broken)
    metrics |= {
        "time_at_break": (time, "s"),
        "standoff": (target.geometry.gap, "m") if shape is not broken else standoff,
    }
    return replace(shape, metrics=shape.metrics | metrics)


def travel(target: JointGeometry, flow: LiquidFlow, speed: float | None = None) -> Travel:
    """Return the straight motion of a package, the second plate of a joint, from its present position to a target.

    Args:
        target: Geometry of the joint at the target.
        flow: Flow of the joint.
        speed: Speed of the package [m/s]; None for a fifth of a spacing in the longest time step.

    Returns:
        Motion of the plate: target position, speed [m/s] and lever of rotations [m].
    """
    if speed is None:
        speed = SPACINGS_PER_STEP * flow.body.cloud.spacing / flow.time_step.largest
    return Travel(1, joint_plates(target)[1], speed, lever=target.radius_package)
