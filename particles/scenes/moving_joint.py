"""A joint whose package floats on the solder, or is moved: slowly from place to place, or at a speed."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import ceil, degrees, hypot

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import joint_plates, placed_geometry
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.plate_motion import PlateMotion, Travel
from reflowshock.particles.scenes.metrics import Metrics
from reflowshock.particles.scenes.reflow import joint_shape, parted, start_joint
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import run_to_rest
from reflowshock.particles.steps.shape import JointShape

SPACINGS_IN_A_STEP = 0.2
ALIGNED = 0.01  # of a radius, and rad


def settle_joint(
    geometry: JointGeometry,
    solder: Solder,
    motions: Sequence[PlateMotion],
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> JointShape:
    """Let a joint come to rest with plates that move: its metrics are those of where the plates end, and that place.

    Args:
        geometry: where the plates start.
        solder: volume, fluid and process; the rigid motion of a floating plate is soft, so that a
            `time_step_limit` of 100 is five times faster than one of 20.
        motions: of the plates that do not rest.
        progress: called with the fraction done.
        checkpoint: where the run continues from, to the last bit, and leaves its state.

    Raises: as `solve_joint`.
    """
    flow, rule = start_joint(geometry, solder)
    flow.physics = replace(flow.physics, motions=motions)
    run = run_to_rest(flow, rule, progress, checkpoint=checkpoint)
    placed = placed_geometry(geometry, flow.body.plates)
    shape = joint_shape(_aligned(placed), solder, flow, run)
    place = {"offset": (hypot(*placed.offset), "m"), "tilt": (degrees(hypot(*placed.tilt)), "deg")}
    return replace(shape, metrics=shape.metrics | place)


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
    """Move the package along a path and yield the joint at rest, at the start and in each place.

    The path ends early where the neck ruptures. In the quasi-static mode the speed between the places has no meaning,
    the plate goes a fifth of a spacing in the longest time step. With inertia it has, and where the neck breaks the
    package takes its part of the solder along to where it goes; both parts come to rest there.

    Args:
        geometry: where the joint reflows.
        solder: volume, fluid and numerics; `max_steps` holds for each place.
        path: places of the package (gap, offset and tilt) one after the other.
        checkpoints: gives the checkpoint of each place by its number, that of the start is 0.
        speed: of the package where inertia acts [m/s].

    Raises: as `solve_joint`.
    """
    flow, rule = start_joint(geometry, solder)
    for number, place in enumerate((geometry, *path)):
        motion, begun = travel(place, flow, speed), flow.time
        steps = ceil(motion.duration(flow.body.plates[1]) / flow.time_step.largest)
        flow.physics = replace(flow.physics, motions=(motion,))
        checkpoint = checkpoints(number) if checkpoints else None
        last = replace(rule, max_steps=flow.steps + steps + rule.max_steps, end_time=begun + rule.end_time)
        run = run_to_rest(flow, last, checkpoint=checkpoint)
        if run.ruptured:
            time, there = flow.time - begun, placed_geometry(place, flow.body.plates)
            yield _broken(joint_shape(there, solder, flow, run), place, solder, flow, time)
            return
        yield joint_shape(place, solder, flow, run)


def _broken(joint: JointShape, place: JointGeometry, solder: Solder, flow: LiquidFlow, time: float) -> JointShape:
    """Return a joint that broke on its path, with the standoff at break; with inertia, as the two drops.

    Args:
        joint: when it broke.
        place: to which the package goes on with inertia.
        solder: volume, fluid and numerics.
        flow: of the joint.
        time: that it was on the way [s].
    """
    found: Metrics = {"standoff_at_break": joint.metrics["standoff"]}
    if not flow.physics.momenta:
        return replace(joint, metrics=joint.metrics | found)
    shape = parted(place, solder, flow, joint)
    found |= {
        "time_at_break": (time, "s"),
        "standoff": (place.gap, "m") if shape is not joint else joint.metrics["standoff"],
    }
    return replace(shape, metrics=shape.metrics | found)


def travel(place: JointGeometry, flow: LiquidFlow, speed: float | None = None) -> Travel:
    """Motion of a package to a place; without a speed [m/s] a fifth of a spacing in the longest time step."""
    if speed is None:
        speed = SPACINGS_IN_A_STEP * flow.body.cloud.spacing / flow.time_step.largest
    return Travel(1, joint_plates(place)[1], speed, lever=place.radius_package)
