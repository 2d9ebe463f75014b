"""Joint between plates that a structure moves, with its state in a file between two exchanges.

Each exchange starts from the rest state of the one before and costs a fraction of the first reflow. The file holds the
complete state, so any process may continue the joint. The iteration with the structure starts from an estimate of the
joint's stiffness.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import isfinite, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.cloud import TooLittleSolder
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.effects import acting_weight, decide_effects
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.forces import Wetting
from reflowshock.particles.physics.physics import plate_wrench
from reflowshock.particles.scenes.moving_joint import travel
from reflowshock.particles.scenes.reference_shapes import reference_meridian
from reflowshock.particles.scenes.reflow import LiquidJoint, solve_joint
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import RECORDS, NotAtRest, Run, run_to_rest
from reflowshock.particles.steps.shape import JointShape

RELATIVE_STEP = 0.01  # step of the finite difference over the gap
PATH_DEPENDENT = ("time_at_rest", "_loss")  # endings of the metrics that depend on the path of the plates


@dataclass(frozen=True, slots=True)
class Carried:
    """Wrenches of a joint at rest on its pads.

    Attributes:
        wrenches: Force [N] and moment about the pad's centre [N m] on board and package in the joint's frame,
            shape (2, 6).
        steps: Number of time steps of this exchange.
    """

    wrenches: Floats
    steps: int


OPEN = Carried(np.zeros((2, 6)), 0)  # solder that does not span the gap exerts no force


def carry_joint(
    place: JointGeometry,
    solder: Solder,
    before: Checkpoint | None,
    now: Checkpoint,
    progress: Callable[[float], None] | None = None,
) -> Carried:
    """Move the package of a joint to a new geometry and return the wrenches at rest.

    Args:
        place: New geometry: gap, radii, offset and tilt.
        solder: Volume, fluid and numerics; ``max_steps`` applies to each exchange.
        before: Checkpoint of the exchange before; None or an empty one starts a reflow.
        now: Checkpoint from which this run continues, to the last bit, and to which it saves its state.
        progress: Function called with the fraction done, 0 to 1.

    Returns:
        Force and moment about the pad's centre on board and package, in the joint's frame, shape (2, 6) [N, N m], and
        the number of steps; zero for an open joint, one with too little solder, or one that broke before.

    Raises:
        NotAtRest: The joint is not at rest after ``solder.numerics.max_steps``, or at the end of the process.
        SolveFailed: A linear solve failed.
    """
    joint = LiquidJoint(place, solder)
    state = None if before is None else before.read(RECORDS)
    if state is not None:
        if state["run"]["ruptured"]:
            now.write(state)
            return OPEN
        flow = _restored_flow(state, joint)
    else:
        try:
            flow = joint.start()
        except TooLittleSolder:
            return OPEN
    rule = joint.stop_rule(flow)
    flow.set_plate_motions((travel(place, flow),))
    last = replace(rule, max_steps=flow.steps + rule.max_steps, end_time=flow.time + rule.end_time)
    run = run_to_rest(flow, last, progress, checkpoint=now)
    if run.ruptured:
        return OPEN
    if not run.at_rest:
        raise NotAtRest(
            f"the process ends before the joint is at rest, after {solder.process_time:.3g} s (solder.process_time) "
            f"and {len(run.records)} steps; try a longer process time"
        )
    return Carried(_wrenches(flow), len(run.records))


def _restored_flow(state: Mapping[str, Any], joint: LiquidJoint) -> LiquidFlow:
    """Restore a flow from the state in a checkpoint, with the effects decided for its initial gap."""
    cloud = state["flow"]["body"].cloud
    initial = replace(joint.geometry, gap=float(cloud.plates[1].origin[2]))
    flow = LiquidJoint(initial, joint.solder).flow_of(cloud)
    flow.restore(state["flow"])
    return flow


def _wrenches(flow: LiquidFlow) -> Floats:
    """Return the wrenches on both plates, shape (2, 6) [N, N m]."""
    others = [force for force in flow.physics.forces if not isinstance(force, Wetting)]
    return np.array([plate_wrench(flow.body, others, wall) for wall in (0, 1)])


def carried_shape(place: JointGeometry, solder: Solder, first: Checkpoint, last: Checkpoint) -> JointShape:
    """Return the shape of a joint after its last exchange, with the history of the first reflow and the last exchange.

    Time to rest and losses are omitted from the metrics, since they depend on the path.

    Args:
        place: Geometry of the last exchange.
        solder: Volume, fluid and numerics, as in ``carry_joint``.
        first: Checkpoint of the first reflow; may equal ``last``.
        last: Checkpoint of the last exchange; empty if the joint was open from the start.

    Returns:
        Particles, surface, history and metrics at rest.

    Raises:
        TooLittleSolder: No cone of the volume spans the gap, although a drop would reach the other pad.
        NotAtRest: The solder is not at rest after ``solder.numerics.max_steps``.
        SolveFailed: A linear solve failed.
    """
    shape = _last_shape(LiquidJoint(place, solder), first, last)
    metrics = {name: value for name, value in shape.metrics.items() if not name.endswith(PATH_DEPENDENT)}
    return replace(shape, metrics=metrics)


def _last_shape(joint: LiquidJoint, first: Checkpoint, last: Checkpoint) -> JointShape:
    state = last.read(RECORDS)
    if state is None:
        return solve_joint(joint.geometry, joint.solder)
    flow, run = _restored_flow(state, joint), Run.restored(state["run"])
    first_state = None if first.path == last.path else first.read(RECORDS)
    whole = run if first_state is None else _joined(Run.restored(first_state["run"]), run)
    shape = joint.shape(flow, whole)
    return joint.split(flow, shape) if run.ruptured else shape


def _joined(first: Run, last: Run) -> Run:
    """Join a run and a later one."""
    return Run(
        records=first.records + last.records,
        profiles=first.profiles + last.profiles,
        snapshots=first.snapshots + last.snapshots[1:],
        seconds=first.seconds + last.seconds,
        ruptured=last.ruptured,
        calm=last.calm,
        at_rest=last.at_rest,
    )


def stiffness_estimate(geometry: JointGeometry, solder: Solder) -> NDArray[np.float64]:
    """Estimate the derivative of the solder's wrench on the package pad with respect to the motion of a level package.

    The axial stiffness is exact for the Young-Laplace joint. The lateral stiffness pi a gamma / h belongs to a cylinder
    with the radius a of the pad and the height h of the gap, whose sections remain discs. The tilt stiffness follows
    from the axial stiffness distributed over the pad.

    Args:
        geometry: Gap and radii of the joint.
        solder: Volume, surface tension and contact angles.

    Returns:
        Diagonal matrix, shape (6, 6), force [N] and moment [N m] by translations [m] and rotations [rad] along and
        about x, y, z; negative for restoring forces, 0 for rotation about z.
    """
    radius, gap = min(geometry.radius_board, geometry.radius_package), geometry.gap
    lateral = pi * radius * solder.surface_tension / gap
    factors = (1.0 + RELATIVE_STEP, 1.0 - RELATIVE_STEP)
    upper, lower = (axial_force(geometry, solder, factor * gap) for factor in factors)
    axial = (lower - upper) / (2.0 * RELATIVE_STEP * gap)
    axial = axial if isfinite(axial) and axial > 0.0 else 4.0 * lateral  # measured ratio of barrels of 1.2 to 1.7 radii
    tilt = axial * radius**2 / 4.0
    return -np.diag([lateral, lateral, axial, tilt, tilt, 0.0])


def axial_force(geometry: JointGeometry, solder: Solder, gap: float) -> float:
    """Return the axial force on the package [N] of the coaxial Young-Laplace joint at a gap, positive upwards.

    Args:
        geometry: Radii of the discs; gap, offset and tilt are ignored.
        solder: Volume, surface tension and contact angles.
        gap: Gap [m].

    Returns:
        Force; NaN if no such joint exists.
    """
    weight = acting_weight(solder, decide_effects(geometry, solder))
    meridian = reference_meridian(replace(geometry, gap=gap, offset=(0.0, 0.0), tilt=(0.0, 0.0)), solder, weight)
    return float("nan") if meridian is None else meridian.axial_force
