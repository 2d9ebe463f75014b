"""Joints of an array in exchanges with a structure: each distinct joint is computed once and saved in its own file."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reflowshock.particles.parameters.solder import Solder
from reflowshock.workflow.reflow.joints import JointGroup, distinct_joints
from reflowshock.workflow.reflow.pool import JointPool, Shares

if TYPE_CHECKING:
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.particles.scenes.carried_joint import Carried
    from reflowshock.particles.steps.shape import JointShape

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Source:
    """Origin of a joint's file: first joint of the group, number of the exchange, geometry."""

    name: str
    number: int
    place: "JointGeometry"


@dataclass(frozen=True, slots=True)
class CarriedGroup:
    """Group of equal joints after an exchange, with its present file and the file of its first reflow."""

    group: JointGroup
    now: Source
    first: Source


@dataclass(frozen=True, slots=True)
class CarriedReflow:
    """Reflow of a joint from one file to the next; the first reflow starts without a file."""

    files: Path
    solder: Solder
    before: Source | None
    now: Source

    def checkpoint(self, source: Source) -> "Checkpoint":
        """Return the file of a joint."""
        from reflowshock.particles.core.checkpoint import Checkpoint

        return Checkpoint(self.files / f"{source.name}@{source.number}", (source, self.solder))


def records() -> tuple[type, ...]:
    """Return the dataclasses that may occur in the files of jobs and results of ``carry`` and ``finish``.

    Only these types are created when such a file is read by another process.
    """
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.particles.scenes.carried_joint import Carried
    from reflowshock.particles.steps.shape import JointShape, Snapshot

    return CarriedReflow, Source, JointGeometry, Solder, Carried, JointShape, Snapshot


class JointArray:
    """Joints of an array (``coupling.Joints``); equal joints stay one group while their geometries are equal.

    Attributes:
        groups: Groups after the last exchange; a restarted run sets it to the stored groups.
    """

    def __init__(self, solder: Solder, files: Path, pool: JointPool, progress: Callable[[Shares], None]) -> None:
        """Start without joints.

        Args:
            solder: Solder of one joint.
            files: Folder of the joints' files.
            pool: Processes or ranks that compute the joints.
            progress: Function that is called with the fraction done by the name of the first joint of a group.
        """
        self._solder, self._files, self._pool, self._progress = solder, files, pool, progress
        self.groups: list[CarriedGroup] = []

    def exchange(self, number: int, places: "Mapping[str, JointGeometry]") -> dict[str, Floats]:
        """Bring all joints to rest between displaced pads; see ``coupling.Joints``."""
        jobs, groups = {}, []
        for before, group in self._split(places):
            now = Source(group.name, number, group.geometry)
            jobs[group.name] = CarriedReflow(self._files, self._solder, before.now if before else None, now)
            groups.append(CarriedGroup(group, now, before.first if before else now))
        results: dict[str, Carried] = self._pool.run(carry, jobs, self._progress)
        self.groups = groups
        self._tidy(number)
        return {
            name: orientation.wrenches(results[carried.group.name].wrenches)
            for carried in groups
            for name, orientation in carried.group.members.items()
        }

    def _split(self, places: "Mapping[str, JointGeometry]") -> "Iterator[tuple[CarriedGroup | None, JointGroup]]":
        """Yield the present groups, each with its group of the last exchange; groups split, but never merge."""
        if not self.groups:
            yield from ((None, group) for group in distinct_joints(places))
        for before in self.groups:
            for group in distinct_joints({name: places[name] for name in before.group.members}):
                yield before, group

    def _tidy(self, number: int) -> None:
        """Remove the files that no run will read again; first reflows are kept for their history."""
        for path in self._files.glob("*@*"):
            if 0 < int(path.name.partition("@")[2].partition(".")[0]) < number - 1:
                path.unlink()

    def shapes(self) -> "dict[str, JointShape]":
        """Return the final shapes in canonical orientation, by the name of the first joint of a group."""
        jobs = {
            carried.group.name: CarriedReflow(self._files, self._solder, carried.first, carried.now)
            for carried in self.groups
        }
        return self._pool.run(finish, jobs, self._progress)


def carry(job: CarriedReflow, progress: Callable[[float], None]) -> "Carried":
    """Bring a joint to rest at its next position; this function runs in a process of the pool.

    Args:
        job: Geometry, solder, and files of the joint; its present file is read and the next one written.
        progress: Function that is called with the fraction done, 0 to 1.

    Returns:
        Wrenches on the pads of board and package, shape (2, 6) [N, N m], and number of steps.
    """
    from reflowshock.particles.scenes.carried_joint import carry_joint

    before = None if job.before is None else job.checkpoint(job.before)
    return carry_joint(job.now.place, job.solder, before, job.checkpoint(job.now), progress)


def finish(job: CarriedReflow, _progress: Callable[[float], None]) -> "JointShape":
    """Return the shape of a joint with its history since the first reflow; runs in a process of the pool.

    Args:
        job: Solder, and files of the joint after its first reflow and at the end, which are read.
        _progress: Not used; functions of the pool take it.

    Returns:
        Particles, free surface, history and metrics of the joint at the end.
    """
    from reflowshock.particles.scenes.carried_joint import carried_shape

    assert job.before is not None
    return carried_shape(job.now.place, job.solder, job.checkpoint(job.before), job.checkpoint(job.now))
