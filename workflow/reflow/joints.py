"""Reflow of many joints: those that are alike once, several at a time."""

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

ALIKE = 1e-9  # of joints that count as equal: differences of gap, radii, offset, and tilt times radius [m]


@dataclass(frozen=True, slots=True)
class JointReflow:
    """One reflow: geometry, solder, and the file from which it continues if it is there."""

    geometry: "JointGeometry"
    solder: Solder
    checkpoint: Path


def records() -> tuple[type, ...]:
    """Return what jobs and results consist of."""
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.particles.steps.shape import JointShape, Snapshot

    return JointReflow, JointGeometry, Solder, JointShape, Snapshot


@dataclass(frozen=True, slots=True)
class Alike:
    """Joints that are alike but for how they lie.

    Attributes:
        geometry: of the first of them, in canonical orientation.
        members: name of each -> how it lies, seen from there.
    """

    geometry: "JointGeometry"
    members: "dict[str, Orientation]"

    @property
    def name(self) -> str:
        """Name of the first joint, under which the shape is stored."""
        return next(iter(self.members))


def distinct_joints(geometries: "Mapping[str, JointGeometry]") -> list[Alike]:
    """Group joints that are equal to ALIKE but for a turn about z and a mirror image, in the given order.

    Args:
        geometries: joint name -> geometry.
    """
    from reflowshock.particles.scenes.orientation import canonical, sizes

    found: list[Alike] = []
    for name, geometry in geometries.items():
        upright, orientation = canonical(geometry)
        size = sizes(upright)
        twin = next((group for group in found if abs(sizes(group.geometry) - size).max() < ALIKE), None)
        if twin is None:
            found.append(Alike(upright, {name: orientation}))
        else:
            twin.members[name] = orientation
    return found


def joint_records(
    groups: Sequence[Alike], geometries: "Mapping[str, JointGeometry]", shapes: "Mapping[str, JointShape]"
) -> dict:
    """Return per joint its shape, place and metrics.

    Args:
        groups: joints that are alike.
        geometries: joint name -> geometry.
        shapes: name of the first of each group -> shape in canonical orientation.

    Returns:
        Joint name -> ``shape``, ``turn`` [rad] and ``mirror`` (how it lies seen from that shape: mirrored first, y to
        -y, then turned about z), ``place`` of the package's pad over the board's, ``verdict``, ``metrics``.
    """
    from reflowshock.particles.scenes.products import untimed

    records: dict[str, dict] = {}
    for group in groups:
        shape = shapes[group.name]
        metrics = {key: {"value": value, "unit": unit} for key, (value, unit) in untimed(shape.metrics).items()}
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
    """Give joints that touch others the verdict "bridged" and the names of those others.

    Args:
        records: what `joint_records` returned; changed in place.
        pads: the pad table.
        mirrored: whether the array goes on beyond the planes of symmetry x = 0 and y = 0.

    Returns:
        The pairs that touch, the largest overlap first.
    """
    from reflowshock.particles.scenes.bridge import contacts, neighbours

    places = {pad.name: (pad.x, pad.y) for pad in pads}
    widths = {name: records[name]["metrics"]["max_width"]["value"] for name in places}
    found = contacts(places, widths, mirrored)
    for name, others in neighbours(found).items():
        records[name] |= {"verdict": "bridged", "touches": others}
    return found


def bridge_shapes(
    found: "Sequence[Contact]", geometries: "Mapping[str, JointGeometry]", solder: Solder
) -> "dict[str, JointShape]":
    """Flow the two joints that overlap most into one: its shape under both names, "A9+A10"; nothing where none touch.

    The bridge is a picture of what happens: its joints are taken as upright and in line, and relax to rest.

    Args:
        found: the pairs that touch, the largest overlap first.
        geometries: joint name -> geometry, of those that were reflowed.
        solder: of one joint.
    """
    from reflowshock.particles.scenes.bridge import solve_bridge
    from reflowshock.particles.scenes.reflow import solve_joint
    from reflowshock.particles.steps.rest import NotAtRest
    from reflowshock.particles.surface.cloud_level_set import CannotRebuild

    bridges, relaxing = {}, _relaxing(solder)
    reflowed = [pair for pair in found if pair.first in geometries and pair.second in geometries]
    for pair in reflowed[:1]:
        ends = [replace(geometries[end], offset=(0.0, 0.0), tilt=(0.0, 0.0)) for end in (pair.first, pair.second)]
        name = f"{pair.first}+{pair.second}"
        try:
            alone = [solve_joint(end, relaxing) for end in ends]
            bridges[name] = solve_bridge(ends, alone, pair.distance, relaxing)
        except (CannotRebuild, NotAtRest) as error:  # the verdict stands without it
            logger.warning("%s are bridged, but their common body was not found: %s", name, error)
    return bridges


def _relaxing(solder: Solder) -> Solder:
    """Return the solder without inertia, with the default scheme."""
    numerics = solder.numerics.model_copy(update={"scheme": "energy"})
    effects = solder.effects.model_copy(update={"inertia": "off", "viscosity": "off"})
    return solder.model_copy(update={"numerics": numerics, "effects": effects})


def refuse_joints_without_mesh(records: Mapping[str, dict], verdicts: Sequence[str] = ("bridged", "open")) -> None:
    """Raise ReflowError where joints are bridged or open: they have no shape of their own between their pads."""
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
    """Solve the reflow of each geometry; joints that an earlier run finished or began continue from their checkpoints.

    Args:
        geometries: name of a joint -> geometry.
        solder: volume, fluid and process.
        pool: what computes.
        progress: called with the share of the whole that is done, 0 to 1.
        checkpoints: folder of the checkpoints.

    Returns:
        Name -> shape, in the given order, and the number of joints that continued.

    Raises:
        ReflowError: names the first joint that failed, and how.
    """
    jobs = {name: JointReflow(geometry, solder, checkpoints / name) for name, geometry in geometries.items()}
    results = pool.run(_solve, jobs, lambda done: progress(sum(done.values()) / len(done)))
    return {name: shape for name, (shape, _) in results.items()}, sum(continued for _, continued in results.values())


def _solve(job: JointReflow, progress: Callable[[float], None]) -> "tuple[JointShape, bool]":
    """Return the shape, and whether it continued from a checkpoint."""
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.reflow import solve_joint

    checkpoint = Checkpoint(job.checkpoint, (job.geometry, job.solder))
    shape = solve_joint(job.geometry, job.solder, progress=progress, checkpoint=checkpoint)
    return shape, checkpoint.continued
