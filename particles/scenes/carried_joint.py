"""A joint between plates that a structure moves: carried from place to place, kept in a file in between.

The flow at rest in one place is where the next one begins, so that a further exchange with the structure costs a
fraction of a first reflow. The file holds the complete state, so any process may continue the joint. The exchange
starts from an estimate of the joint's stiffness.
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
from reflowshock.particles.parameters.effects import acting_weight, decide_effects, switched
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.forces import Wetting
from reflowshock.particles.physics.physics import plate_wrench
from reflowshock.particles.scenes.metrics import reference_meridian
from reflowshock.particles.scenes.moving_joint import travel
from reflowshock.particles.scenes.reflow import joint_flow, joint_shape, parted, solve_joint, start_joint, stop_rule
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import RECORDS, NotAtRest, Run, StopRule, run_to_rest
from reflowshock.particles.steps.shape import JointShape

STEP = 0.01  # of the gap
OF_WAY = ("time_at_rest", "_loss")  # how metrics end that add up to nothing: places are reached by any way


@dataclass(frozen=True, slots=True)
class Carried:
    """Wrenches of a joint at rest on its pads.

    Attributes:
        wrenches: `(2, 6)` force [N] and moment about the pad's centre [N m] on board and package, in the joint's frame.
        steps: of this exchange.
    """

    wrenches: Floats
    steps: int


OPEN = Carried(np.zeros((2, 6)), 0)  # solder that does not span the gap pulls at nothing


def carry_joint(
    place: JointGeometry,
    solder: Solder,
    before: Checkpoint | None,
    now: Checkpoint,
    progress: Callable[[float], None] | None = None,
) -> Carried:
    """Let a joint come to rest in a place, by the scheme ispg with inertia, else quasi-statically.

    Args:
        place: gap, radii, offset and tilt.
        solder: volume, fluid and numerics; `max_steps` holds for each place.
        before: where it was left in the place before; None, or nothing in it, starts a reflow.
        now: where this run continues from, to the last bit, and leaves its state.
        progress: called with the fraction done.

    Raises:
        NotAtRest: no rest within `solder.numerics.max_steps`, or before the process ends.
        SolveFailed: a linear solve failed.

    An open joint, one with too little solder included, does nothing to its pads.
    """
    known = None if before is None else before.read(RECORDS)
    if known is not None:
        if known["run"]["ruptured"]:
            now.write(known)
            return OPEN
        flow = _resumed(known, place, solder)
        rule = _rule(flow, place, solder)
    else:
        try:
            flow, rule = start_joint(place, solder)
        except TooLittleSolder:
            return OPEN
    flow.physics = replace(flow.physics, motions=(travel(place, flow),))
    last = replace(rule, max_steps=flow.steps + rule.max_steps, end_time=flow.time + rule.end_time)
    run = run_to_rest(flow, last, progress, checkpoint=now)
    if run.ruptured:
        return OPEN
    if not run.at_rest:
        raise NotAtRest(
            f"the process ends before the joint is at rest, after {solder.process_time:.3g} s (solder.process_time) "
            f"and {len(run.records)} steps; a slower process helps"
        )
    return Carried(_wrenches(flow), len(run.records))


def _resumed(known: Mapping[str, Any], place: JointGeometry, solder: Solder) -> LiquidFlow:
    """Restore a flow, with the effects decided for its initial gap."""
    cloud = known["flow"]["body"].cloud
    flow = joint_flow(cloud, replace(place, gap=float(cloud.plates[1].origin[2])), solder)
    flow.restore(known["flow"])
    return flow


def _rule(flow: LiquidFlow, place: JointGeometry, solder: Solder) -> StopRule:
    return stop_rule(flow.body.cloud, solder, switched(decide_effects(place, solder)))


def _wrenches(flow: LiquidFlow) -> Floats:
    """Wrenches on both plates `(2, 6)`."""
    others = [force for force in flow.physics.forces if not isinstance(force, Wetting)]
    return np.array([plate_wrench(flow.body, others, wall) for wall in (0, 1)])


def carried_shape(place: JointGeometry, solder: Solder, first: Checkpoint, last: Checkpoint) -> JointShape:
    """Return the shape of a joint in its last place, with the history of its first reflow and of its last exchange.

    Time to rest and losses are omitted from the metrics, since they depend on the path.

    Args:
        place: the last one.
        solder: as carried.
        first: where the reflow left it; may be the last.
        last: where it was left in the last place; nothing in it where the joint was open from the start.

    Raises: as `solve_joint`.
    """
    shape = _last_shape(place, solder, first, last)
    return replace(shape, metrics={name: one for name, one in shape.metrics.items() if not name.endswith(OF_WAY)})


def _last_shape(place: JointGeometry, solder: Solder, first: Checkpoint, last: Checkpoint) -> JointShape:
    known = last.read(RECORDS)
    if known is None:
        return solve_joint(place, solder)
    flow, run = _resumed(known, place, solder), Run.restored(known["run"])
    begun = None if first.path == last.path else first.read(RECORDS)
    whole = run if begun is None else _joined(Run.restored(begun["run"]), run)
    shape = joint_shape(place, solder, flow, whole)
    return parted(place, solder, flow, shape) if run.ruptured else shape


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
    """Return the derivative `(6, 6)` of the solder's wrench on the package's pad by its motion, where it is level.

    Along z it is that of the Young-Laplace joint. Sideways a cylinder of the pad's radius a and the gap h, whose
    sections stay discs, resists with pi a gamma / h; a tilt as if each part of the pad bore what it does along z.
    """
    radius, gap = min(geometry.radius_board, geometry.radius_package), geometry.gap
    lateral = pi * radius * solder.surface_tension / gap
    upper, lower = (axial_force(geometry, solder, factor * gap) for factor in (1.0 + STEP, 1.0 - STEP))
    axial = (lower - upper) / (2.0 * STEP * gap)
    axial = axial if isfinite(axial) and axial > 0.0 else 4.0 * lateral  # what barrels of 1.2 to 1.7 radii have
    tilt = axial * radius**2 / 4.0
    return -np.diag([lateral, lateral, axial, tilt, tilt, 0.0])


def axial_force(geometry: JointGeometry, solder: Solder, gap: float) -> float:
    """Force on the package along z [N] of the coaxial Young-Laplace joint at a gap [m]; nan where there is none."""
    weight = acting_weight(solder, decide_effects(geometry, solder))
    meridian = reference_meridian(replace(geometry, gap=gap, offset=(0.0, 0.0), tilt=(0.0, 0.0)), solder, weight)
    return float("nan") if meridian is None else meridian.axial_force
