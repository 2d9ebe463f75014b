"""Reflow of many joints: those that are alike once, several at a time, each in a process of its own."""

import logging
import multiprocessing
import os
import queue
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from particles.parameters import Solder

if TYPE_CHECKING:
    from meshing.pads import PadSite
    from particles.bridges import Contact
    from particles.geometry import JointGeometry
    from particles.shape import JointShape

logger = logging.getLogger(__name__)

ALIKE = 12  # decimals of a metre to which gaps and radii of joints are compared: a picometre
POLL = 0.2  # seconds between two looks at the progress

_progress: Any = None  # the queue of a worker process: a pool has no other place for it


@dataclass(frozen=True, slots=True)
class Job:
    """One reflow: name of the joint, gap and radii, solder, and the file from which it continues if it is there."""

    name: str
    geometry: "JointGeometry"
    solder: Solder
    checkpoint: Path


class ReflowError(RuntimeError):
    """The reflow of a joint failed; the message names the joint."""


def joint_geometries(pads: "Sequence[PadSite]") -> "dict[str, JointGeometry]":
    """Return the geometry of each joint of a pad table, by name."""
    from particles.geometry import JointGeometry

    return {pad.name: JointGeometry(pad.gap, pad.wetted_radius_board, pad.wetted_radius_package) for pad in pads}


def distinct_geometries(geometries: "Mapping[str, JointGeometry]") -> "dict[tuple[str, ...], JointGeometry]":
    """Group joints of equal geometry.

    Args:
        geometries: joint name -> geometry.

    Returns:
        Names of the joints that are alike -> their geometry.
    """
    groups: dict[tuple[float, ...], list[str]] = {}
    for name, geometry in geometries.items():
        discs = (geometry.gap, geometry.radius_board, geometry.radius_package)
        sizes = (*discs, *geometry.offset, *geometry.tilt)
        groups.setdefault(tuple(round(size, ALIKE) for size in sizes), []).append(name)
    return {tuple(names): geometries[names[0]] for names in groups.values()}


def joint_records(groups: "Mapping[tuple[str, ...], JointGeometry]", shapes: "Mapping[str, JointShape]") -> dict:
    """Return per joint the name of its shape, the verdict on it and its metrics."""
    records: dict[str, dict] = {}
    for names in groups:
        shape = shapes[names[0]]
        metrics = {key: {"value": value, "unit": unit} for key, (value, unit) in shape.metrics.items()}
        records |= {name: {"shape": names[0], "verdict": shape.verdict, "metrics": metrics} for name in names}
    return records


def mark_bridges(records: dict[str, dict], pads: "Sequence[PadSite]", mirrored: bool) -> "list[Contact]":
    """Give joints that touch others the verdict "bridged" and the names of those others.

    Args:
        records: what `joint_records` returned; changed in place.
        pads: the pad table.
        mirrored: whether the array goes on beyond the planes of symmetry x = 0 and y = 0.

    Returns:
        The pairs that touch, the largest overlap first.
    """
    from particles.bridges import contacts, neighbours

    places = {pad.name: (pad.x, pad.y) for pad in pads}
    widths = {name: records[name]["metrics"]["max_width"]["value"] for name in places}
    found = contacts(places, widths, mirrored)
    for name, others in neighbours(found).items():
        records[name] |= {"verdict": "bridged", "touches": others}
    return found


def bridge_shapes(
    found: "Sequence[Contact]",
    groups: "Mapping[tuple[str, ...], JointGeometry]",
    shapes: "Mapping[str, JointShape]",
    solder: Solder,
) -> "dict[str, JointShape]":
    """Flow the two joints that overlap most into one: its shape under both names, "A9+A10"; nothing where none touch.

    Args:
        found: the pairs that touch, the largest overlap first.
        groups: names of the joints that are alike -> their geometry.
        shapes: first of these names -> shape at rest, alone.
        solder: of one joint.
    """
    from particles.bridge import solve_bridge
    from particles.cloud_level_set import CannotRebuild
    from particles.rest import NoRest

    geometry_of = {name: geometry for names, geometry in groups.items() for name in names}
    shape_of = {name: shapes[names[0]] for names in groups for name in names}
    bridges = {}
    for pair in found[:1]:
        ends, name = (pair.first, pair.second), f"{pair.first}+{pair.second}"
        try:
            alone = [geometry_of[end] for end in ends], [shape_of[end] for end in ends]
            bridges[name] = solve_bridge(*alone, pair.distance, solder)
        except (CannotRebuild, NoRest) as error:  # the verdict stands without it
            logger.warning("%s are bridged, but their common body was not found: %s", name, error)
    return bridges


def refuse_joints_without_mesh(records: Mapping[str, dict]) -> None:
    """Raise ReflowError where joints are bridged or open: they have no shape of their own between their pads."""
    for verdict in ("bridged", "open"):
        names = [name for name, record in records.items() if record["verdict"] == verdict]
        if names:
            raise ReflowError(f"{', '.join(names)} {verdict}: there is no such joint to mesh, see reflow/joints.json")


def solve_joints(
    geometries: "Mapping[str, JointGeometry]",
    solder: Solder,
    cores: int,
    progress: Callable[[float], None],
    checkpoints: Path,
) -> "tuple[dict[str, JointShape], int]":
    """Solve the reflow of each geometry; joints that an earlier run finished or began continue from their checkpoints.

    Args:
        geometries: name of a joint -> geometry.
        solder: volume, fluid and process.
        cores: number of processes.
        progress: called with the share of the whole that is done, 0 to 1.
        checkpoints: folder of the checkpoints.

    Returns:
        Name -> shape, in the given order, and the number of joints that continued.

    Raises:
        ReflowError: names the first joint that failed, and how.
    """
    context = multiprocessing.get_context("spawn")
    reports = context.Queue()
    workers = min(cores, len(geometries))
    with ProcessPoolExecutor(workers, context, _start_worker, (reports, cores // workers)) as pool:
        jobs = {
            pool.submit(_solve, Job(name, geometry, solder, checkpoints / name)): name
            for name, geometry in geometries.items()
        }
        try:
            _wait_for(jobs, reports, progress)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()
            raise
    results = {name: job.result() for job, name in jobs.items()}
    return {name: shape for name, (shape, _) in results.items()}, sum(continued for _, continued in results.values())


def _wait_for(jobs: "Mapping[Future, str]", reports: Any, progress: Callable[[float], None]) -> None:
    """Wait for all jobs, passing on how far they are; raise as soon as one fails."""
    done = dict.fromkeys(jobs.values(), 0.0)
    pending: Sequence[Future] | set[Future] = set(jobs)
    while pending:
        finished, pending = wait(pending, POLL, FIRST_COMPLETED)
        while True:
            try:
                name, fraction = reports.get_nowait()
            except queue.Empty:
                break
            done[name] = max(done[name], fraction)
        for job in finished:
            error = job.exception()
            if error is not None:
                raise ReflowError(f"joint {jobs[job]}: {type(error).__name__}: {error}") from error
            done[jobs[job]] = 1.0
        progress(sum(done.values()) / len(done))


def _start_worker(reports: Any, threads: int) -> None:
    global _progress
    os.environ["NUMBA_NUM_THREADS"] = str(threads)  # numba, which is loaded after this, would take all cores
    _progress = reports
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent was killed: it would compete with the workers of the run that continues."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _solve(job: Job) -> "tuple[JointShape, bool]":
    """Return the shape, and whether it continued from a checkpoint."""
    from particles.checkpoint import Checkpoint
    from particles.reflow import solve_joint

    checkpoint = Checkpoint(job.checkpoint, (job.geometry, job.solder))

    def report(fraction: float) -> None:
        _progress.put((job.name, fraction))

    shape = solve_joint(job.geometry, job.solder, progress=report, checkpoint=checkpoint)
    return shape, checkpoint.continued
