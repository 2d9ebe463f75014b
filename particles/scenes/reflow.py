"""Reflow of one joint: from the wetted discs, the gap and the solder to the shape at rest.

The flow starts from a double cone, far from rest, and keeps its volume by one global constraint. It is quasi-static
unless the process is short against the slowest time of the body. On the solder mask the contact line moves; the gap
remains the distance of the pad centres. Drops on a wall come to rest up to Bond numbers of about 15, or 10 at large
contact angles; flatter puddles do not.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.cloud import Cloud, TooLittleSolder, box_cloud, joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.effects import AT_REST, decide_effects, switched
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.flow_setup import contact_line, pad_lines, start_flow, stop_rule
from reflowshock.particles.scenes.metrics import Metrics, joint_metrics, open_metrics, particle_pressure, verdict
from reflowshock.particles.scenes.rebuild import split_shape, split_to_rest
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run, StopRule, run_to_rest
from reflowshock.particles.steps.shape import JointShape, Snapshot

FEWEST_PER_EDGE = 5


@dataclass(frozen=True, slots=True)
class LiquidJoint:
    """Molten joint between two pads: set-up of its flow, and the shapes that result from it.

    Attributes:
        geometry: Gap, pad radii, offset and tilt.
        solder: Volume, fluid, process and numerics.
    """

    geometry: JointGeometry
    solder: Solder

    @property
    def effects(self) -> dict[str, bool]:
        """Name of each effect -> on or off, decided for this geometry."""
        return switched(decide_effects(self.geometry, self.solder))

    def start(self) -> LiquidFlow:
        """Return the flow at its start: a double cone of the solder's volume on both pads.

        Raises:
            TooLittleSolder: No cone of the volume spans the gap.
        """
        return self.flow_of(joint_cloud(self.geometry, self.solder.volume, self.solder.numerics.spacing))

    def start_on_board(self) -> LiquidFlow:
        """Return the flow of a cube of the solder's volume on the pad of the board alone."""
        edge = float(np.cbrt(self.solder.volume))
        cloud = box_cloud(edge, max(FEWEST_PER_EDGE, 1 + round(edge / self.solder.numerics.spacing)))
        lines = (contact_line(cloud, 0, self.geometry.radius_board, self.solder),)
        return start_flow(cloud, self.solder, self.effects, lines)

    def flow_of(self, cloud: Cloud) -> LiquidFlow:
        """Return the flow at rest of a cloud that spans the gap, with one contact line on each pad."""
        radii = (self.geometry.radius_board, self.geometry.radius_package)
        lines = tuple(contact_line(cloud, wall, radius, self.solder) for wall, radius in enumerate(radii))
        return start_flow(cloud, self.solder, self.effects, lines)

    def stop_rule(self, flow: LiquidFlow) -> StopRule:
        """Return the rule that ends a flow of this joint."""
        return stop_rule(flow.body.cloud, self.solder, self.effects)

    def shape(self, flow: LiquidFlow, run: Run) -> JointShape:
        """Return the shape at the end of a run, with the metrics of a joint in this geometry."""
        return collect_shape(self.solder, flow, run, joint_metrics(self.geometry, self.solder, flow, run))

    def open_shape(self, flow: LiquidFlow, run: Run) -> JointShape:
        """Return the shape of an open joint at the end of a run that started on the board.

        Raises:
            TooLittleSolder: The drop reaches the other pad, although no double cone does.
        """
        height, gap = run.records[-1].height, self.geometry.gap
        if height >= gap:
            raise TooLittleSolder(f"a drop of {height:.4g} m reaches across the gap of {gap:.4g} m, no joint does")
        metrics = open_metrics(self.geometry, self.solder, flow, run)
        return replace(collect_shape(self.solder, flow, run, metrics), verdict="open")

    def split(self, flow: LiquidFlow, shape: JointShape) -> JointShape:
        """Return the shape of one drop at rest on each pad, after the neck of a joint has collapsed.

        Args:
            flow: Flow of the joint when its neck collapsed.
            shape: Shape of the joint at that time; returned unchanged where its neck cannot be cut.
        """
        effects = self.effects
        if self.solder.numerics.scheme != "ispg":
            effects |= AT_REST

        def start(body: Body) -> LiquidFlow:
            drop = start_flow(body.cloud, self.solder, effects, pad_lines(body.cloud, self.solder))
            drop.set_plate_motions(flow.motions_after_split(body.plates[0].side))
            return drop

        drops = split_to_rest(flow, stop_rule(flow.body.cloud, self.solder, effects), start)
        return split_shape(shape, self.solder, drops) if drops else shape


def solve_joint(
    geometry: JointGeometry,
    solder: Solder,
    progress: Callable[[float], None] | None = None,
    on_snapshot: Callable[[Snapshot], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> JointShape:
    """Compute the flow of molten solder between two pads until it is at rest.

    The solder starts as a double cone of its volume on both pads and flows by the effects of ``decide_effects``. Solder
    too little for a cone starts as a cube on the board; the joint is open. A joint with a collapsed neck is open, too,
    with a drop on each pad.

    Args:
        geometry: Gap and pad radii [m].
        solder: Volume, fluid, process and numerics.
        progress: Function called with the fraction done, 0 to 1.
        on_snapshot: Function called with each new snapshot.
        checkpoint: File from which the run continues, to the last bit, and to which it saves its state.

    Returns:
        Particles, surface, history and metrics at rest.

    Raises:
        TooLittleSolder: No cone of the volume spans the gap, although a drop would reach the other pad.
        NotAtRest: The solder is not at rest after ``solder.numerics.max_steps``.
        SolveFailed: A linear solve failed.
    """
    joint = LiquidJoint(geometry, solder)
    try:
        flow = joint.start()
    except TooLittleSolder:
        flow = joint.start_on_board()
    run = run_to_rest(flow, joint.stop_rule(flow), progress, on_snapshot, checkpoint)
    if len(flow.body.cloud.rings) == 1:
        return joint.open_shape(flow, run)
    shape = joint.shape(flow, run)
    return joint.split(flow, shape) if run.ruptured else shape


def collect_shape(solder: Solder, flow: LiquidFlow, run: Run, metrics: Metrics) -> JointShape:
    """Return the shape of a liquid at the end of a run, with its history, snapshots and verdict.

    Args:
        solder: Fluid properties.
        flow: Flow at the end of the run: body, physics and time.
        run: Steps of the run: a record and a profile of each, and snapshots.
        metrics: Metrics of the shape.
    """
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
