"""The joints of an array in exchanges with a structure: those that are alike once, each kept in a file of its own."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reflowshock.particles.parameters.solder import Solder
from reflowshock.workflow.reflow.joints import Alike, distinct_joints
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
class Left:
    """Group of equal joints after an exchange, with its present file and the file of its first reflow."""

    group: Alike
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
    """Return what jobs and results consist of."""
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.particles.scenes.carried_joint import Carried
    from reflowshock.particles.steps.shape import JointShape, Snapshot

    return CarriedReflow, Source, JointGeometry, Solder, Carried, JointShape, Snapshot


class JointArray:
    """Joints of an array (`coupling.Joints`); equal joints stay one group while their geometries are equal.

    Attributes:
        left: Groups after the last exchange; a restarted run sets it to the stored groups.
    """

    def __init__(self, solder: Solder, files: Path, pool: JointPool, progress: Callable[[Shares], None]) -> None:
        """Start without joints.

        Args:
            solder: of one joint.
            files: folder of the joints' files.
            pool: what computes.
            progress: called with name -> fraction done, of the first joint of those that are alike.
        """
        self._solder, self._files, self._pool, self._progress = solder, files, pool, progress
        self.left: list[Left] = []

    def exchange(self, number: int, places: "Mapping[str, JointGeometry]") -> dict[str, Floats]:
        """Bring all joints to rest in their places; see `coupling.Joints`."""
        jobs, left = {}, []
        for before, group in self._parted(places):
            now = Source(group.name, number, group.geometry)
            jobs[group.name] = CarriedReflow(self._files, self._solder, before.now if before else None, now)
            left.append(Left(group, now, before.first if before else now))
        found: dict[str, Carried] = self._pool.run(carry, jobs, self._progress)
        self.left = left
        self._tidy(number)
        return {
            name: lies.wrenches(found[one.group.name].wrenches)
            for one in left
            for name, lies in one.group.members.items()
        }

    def _parted(self, places: "Mapping[str, JointGeometry]") -> "Iterator[tuple[Left | None, Alike]]":
        """Yield all joints that are alike, and where they were left: groups part, but never join."""
        if not self.left:
            yield from ((None, group) for group in distinct_joints(places))
        for before in self.left:
            for group in distinct_joints({name: places[name] for name in before.group.members}):
                yield before, group

    def _tidy(self, number: int) -> None:
        """Remove the files that no run will read again; first reflows are kept for their history."""
        for path in self._files.glob("*@*"):
            if 0 < int(path.name.partition("@")[2].partition(".")[0]) < number - 1:
                path.unlink()

    def shapes(self) -> "dict[str, JointShape]":
        """Return the shapes in their last places and canonical orientation, by the first of the joints alike."""
        jobs = {one.group.name: CarriedReflow(self._files, self._solder, one.first, one.now) for one in self.left}
        return self._pool.run(finish, jobs, self._progress)


def carry(job: CarriedReflow, progress: Callable[[float], None]) -> "Carried":
    """Carry one joint on, in a process of the pool."""
    from reflowshock.particles.scenes.carried_joint import carry_joint

    before = None if job.before is None else job.checkpoint(job.before)
    return carry_joint(job.now.place, job.solder, before, job.checkpoint(job.now), progress)


def finish(job: CarriedReflow, _progress: Callable[[float], None]) -> "JointShape":
    """Return the shape of one joint, in a process of the pool, starting from its first reflow."""
    from reflowshock.particles.scenes.carried_joint import carried_shape

    assert job.before is not None
    return carried_shape(job.now.place, job.solder, job.checkpoint(job.before), job.checkpoint(job.now))
