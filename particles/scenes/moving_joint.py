"""A joint whose package floats on the solder, or is moved slowly from place to place."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import degrees, hypot

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import joint_plates, placed_geometry
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.plate_motion import PlateMotion, Travel
from reflowshock.particles.scenes.reflow import joint_shape, start_joint
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
    """The coaxial joint where a joint differs from one to second order only: it has a meridian to compare with."""
    radius = min(geometry.radius_board, geometry.radius_package)
    nearly = hypot(*geometry.offset) < ALIGNED * radius and hypot(*geometry.tilt) < ALIGNED
    return replace(geometry, offset=(0.0, 0.0), tilt=(0.0, 0.0)) if nearly else geometry


def follow_path(
    geometry: JointGeometry,
    solder: Solder,
    path: Sequence[JointGeometry],
    checkpoints: Callable[[int], Checkpoint] | None = None,
) -> Iterator[JointShape]:
    """Move the package along a path and yield the joint at rest, at the start and in each place.

    The path ends early where the neck ruptures. Call it in the quasi-static mode: the speed between the places has no
    meaning, the plate goes a fifth of a spacing in the longest time step.

    Args:
        geometry: where the joint reflows.
        solder: volume, fluid and numerics; `max_steps` holds for each place.
        path: places of the package (gap, offset and tilt) one after the other.
        checkpoints: gives the checkpoint of each place by its number, that of the start is 0.

    Raises: as `solve_joint`.
    """
    flow, rule = start_joint(geometry, solder)
    for number, place in enumerate((geometry, *path)):
        flow.physics = replace(flow.physics, motions=(travel(place, flow),))
        checkpoint = checkpoints(number) if checkpoints else None
        run = run_to_rest(flow, replace(rule, max_steps=flow.steps + rule.max_steps), checkpoint=checkpoint)
        yield joint_shape(place, solder, flow, run)
        if run.ruptured:
            return


def travel(place: JointGeometry, flow: LiquidFlow) -> Travel:
    """Motion of a package to a place, quasi-static: a fifth of a spacing in the longest time step."""
    speed = SPACINGS_IN_A_STEP * flow.body.cloud.spacing / flow.time_step.largest
    return Travel(1, joint_plates(place)[1], speed, lever=place.radius_package)
