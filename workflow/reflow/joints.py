"""Reflow of many joints: each distinct geometry is computed once, several at a time."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.particles.parameters.solder import Solder
from reflowshock.workflow.reflow.pool import JointPool, ReflowError

if TYPE_CHECKING:
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.particles.scenes.bridge import Contact
    from reflowshock.particles.scenes.orientation import Orientation
    from reflowshock.particles.steps.shape import JointShape

logger = logging.getLogger(__name__)

SAME = 1e-9  # [m] largest difference of gap, radii, offset, and tilt times radius between equal joints


@dataclass(frozen=True, slots=True)
class JointReflow:
    """Job of a pool: geometry and solder of a joint, and the checkpoint from which it continues if that exists."""

    geometry: "JointGeometry"
    solder: Solder
    checkpoint: Path


def records() -> tuple[type, ...]:
    """Return the dataclasses that may occur in the files of jobs and results of this module's functions.

    Only these types are created when such a file is read by another process.
    """
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.particles.steps.shape import JointShape, Snapshot

    return JointReflow, JointGeometry, Solder, JointShape, Snapshot


@dataclass(frozen=True, slots=True)
class JointGroup:
    """Joints of equal geometry, except for their orientation.

    Attributes:
        geometry: Geometry in canonical orientation.
        members: Orientation of each joint relative to this geometry, by joint name.
    """

    geometry: "JointGeometry"
    members: "dict[str, Orientation]"

    @property
    def name(self) -> str:
        """Name of the first joint, under which the shape is stored."""
        return next(iter(self.members))


def distinct_joints(geometries: "Mapping[str, JointGeometry]") -> list[JointGroup]:
    """Group joints whose geometries are equal except for a rotation about z and a reflection.

    Args:
        geometries: Geometry by joint name; groups and their members keep this order.

    Returns:
        Groups of one joint or more, each with its canonical geometry and the orientation of its members.
    """
    from reflowshock.particles.scenes.orientation import canonical, sizes

    groups: list[JointGroup] = []
    for name, geometry in geometries.items():
        upright, orientation = canonical(geometry)
        size = sizes(upright)
        twin = next((group for group in groups if abs(sizes(group.geometry) - size).max() < SAME), None)
        if twin is None:
            groups.append(JointGroup(upright, {name: orientation}))
        else:
            twin.members[name] = orientation
    return groups


def joint_records(
    groups: Sequence[JointGroup], geometries: "Mapping[str, JointGeometry]", shapes: "Mapping[str, JointShape]"
) -> dict:
    """Return the record of each joint for ``joints.json``.

    Args:
        groups: Groups of equal joints.
        geometries: Geometry by joint name.
        shapes: Shape in canonical orientation, by the name of the first joint of a group.

    Returns:
        Record by joint name, in the order of the geometries: ``shape``, the name of the first joint of its group;
        ``mirror`` and ``turn`` [rad], a reflection of y followed by a rotation about z, which give the joint from that
        shape; ``place``, the position of the package's pad relative to the board's: ``gap`` [m], ``offset`` [m] along
        x and y, and ``tilt`` [rad] about them; ``verdict``, a word; ``metrics``, each with ``value`` and ``unit``.
    """
    from reflowshock.particles.scenes.products import remove_timings

    records: dict[str, dict] = {}
    for group in groups:
        shape = shapes[group.name]
        metrics = {key: {"value": value, "unit": unit} for key, (value, unit) in remove_timings(shape.metrics).items()}
        for name, orientation in group.members.items():
            geometry = geometries[name]
            records[name] = {
                "shape": group.name,
                "turn": orientation.turn,
                "mirror": orientation.mirror,
                "place": {"gap": geometry.gap, "offset": geometry.offset, "tilt": geometry.tilt},
                "verdict": shape.verdict,
                "metrics": metrics,
            }
    return {name: records[name] for name in geometries}


def mark_bridges(records: dict[str, dict], pads: "Sequence[PadSite]", mirrored: bool) -> "list[Contact]":
    """Set the verdict of touching joints to "bridged", and list the joints that each touches.

    Args:
        records: Records from ``joint_records``, changed in place.
        pads: Pad table.
        mirrored: Whether the array continues beyond the planes of symmetry x = 0 and y = 0.

    Returns:
        Pairs of touching joints, the largest overlap first.
    """
    from reflowshock.particles.scenes.bridge import contacts, neighbours

    positions = {pad.name: (pad.x, pad.y) for pad in pads}
    widths = {name: records[name]["metrics"]["max_width"]["value"] for name in positions}
    touching = contacts(positions, widths, mirrored)
    for name, touched in neighbours(touching).items():
        records[name] |= {"verdict": "bridged", "touches": touched}
    return touching


def bridge_shapes(
    touching: "Sequence[Contact]", geometries: "Mapping[str, JointGeometry]", solder: Solder
) -> "dict[str, JointShape]":
    """Compute the common shape of the two joints that overlap most, under both names, such as "A9+A10".

    The shape illustrates the bridge: both joints are assumed upright and in line, and the liquid relaxes to rest.

    Args:
        touching: Pairs of touching joints, the largest overlap first.
        geometries: Geometry by name of the joints that were reflowed.
        solder: Solder of one joint.

    Returns:
        Shape by name; empty if no joints touch or the shape cannot be computed.
    """
    from reflowshock.particles.scenes.bridge import solve_bridge
    from reflowshock.particles.scenes.reflow import solve_joint
    from reflowshock.particles.steps.rest import NotAtRest
    from reflowshock.particles.surface.cloud_level_set import CannotRebuild

    bridges, relaxing = {}, _relaxing(solder)
    reflowed = [pair for pair in touching if pair.first in geometries and pair.second in geometries]
    for pair in reflowed[:1]:
        ends = [replace(geometries[end], offset=(0.0, 0.0), tilt=(0.0, 0.0)) for end in (pair.first, pair.second)]
        name = f"{pair.first}+{pair.second}"
        try:
            alone = [solve_joint(end, relaxing) for end in ends]
            bridges[name] = solve_bridge(ends, alone, pair.distance, relaxing)
        except (CannotRebuild, NotAtRest) as error:  # the shape is not needed for the verdict
            logger.warning("%s are bridged, but their common shape was not computed: %s", name, error)
    return bridges


def _relaxing(solder: Solder) -> Solder:
    """Return the solder without inertia, with the default scheme."""
    numerics = solder.numerics.model_copy(update={"scheme": "energy"})
    effects = solder.effects.model_copy(update={"inertia": "off", "viscosity": "off"})
    return solder.model_copy(update={"numerics": numerics, "effects": effects})


def refuse_joints_without_mesh(records: Mapping[str, dict], verdicts: Sequence[str] = ("bridged", "open")) -> None:
    """Raise ReflowError if a joint cannot be meshed because of its verdict.

    Args:
        records: Record by joint name, see ``joint_records``.
        verdicts: Verdicts of joints that cannot be meshed.

    Raises:
        ReflowError: A joint has such a verdict; the message names it.
    """
    for verdict in verdicts:
        names = [name for name, record in records.items() if record["verdict"] == verdict]
        if names:
            raise ReflowError(f"{', '.join(names)} {verdict}: such a joint cannot be meshed, see reflow/joints.json")


def solve_joints(
    geometries: "Mapping[str, JointGeometry]",
    solder: Solder,
    pool: JointPool,
    progress: Callable[[float], None],
    checkpoints: Path,
) -> "tuple[dict[str, JointShape], int]":
    """Compute the reflow of each geometry, continuing from checkpoints of an earlier run.

    Args:
        geometries: Geometry by joint name.
        solder: Solder of one joint.
        pool: Processes or ranks that compute the joints.
        progress: Function that is called with the fraction done of all joints, 0 to 1.
        checkpoints: Folder of the checkpoints.

    Returns:
        Shape by joint name, in the order of the geometries, and the number of joints that continued.

    Raises:
        ReflowError: A joint failed; the message gives its name and error.
    """
    jobs = {name: JointReflow(geometry, solder, checkpoints / name) for name, geometry in geometries.items()}
    results = pool.run(_solve, jobs, lambda shares: progress(sum(shares.values()) / len(shares)))
    return {name: shape for name, (shape, _) in results.items()}, sum(continued for _, continued in results.values())


def _solve(job: JointReflow, progress: Callable[[float], None]) -> "tuple[JointShape, bool]":
    """Return the shape, and whether it continued from a checkpoint."""
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.reflow import solve_joint

    checkpoint = Checkpoint(job.checkpoint, (job.geometry, job.solder))
    shape = solve_joint(job.geometry, job.solder, progress=progress, checkpoint=checkpoint)
    return shape, checkpoint.continued
