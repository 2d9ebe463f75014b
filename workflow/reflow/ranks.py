"""MPI ranks, of any number of machines with a common file system, that bring joints to rest.

The joints do not know each other, so no rank sends anything: jobs, what they gave and their checkpoints are files of
data. Each piece of work is a program of its own, since a rank that waited for the next one would look for it in vain
for as long as a network file system keeps a listing (30 s as usual); its start takes a second or two.
"""

import json
import shutil
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from reflowshock.data_file import NotData, read_data, write_data
from reflowshock.workflow.process.launch import DIE_WITH_PARENT, LaunchError, launch, mpi_command
from reflowshock.workflow.reflow.pool import Job, ReflowError, Report, Result, Shares
from reflowshock.workflow.reflow.rank import JOB, RESULT, TAKEN, Done, name_of, records_of


@dataclass(frozen=True, slots=True)
class Ranks:
    """MPI ranks, a `pool.JointPool`; each takes the next job as it becomes free.

    Attributes:
        count: how many at most.
        oversubscribe: whether there may be more than cores.
        folder: for jobs and results; all ranks see it, and it is removed in the end.
    """

    count: int
    oversubscribe: bool
    folder: Path

    def __enter__(self) -> "Ranks":
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the files."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def run(
        self, work: Callable[[Job, Report], Result], jobs: Mapping[str, Job], progress: Callable[[Shares], None]
    ) -> dict[str, Result]:
        """Do a piece of work for each joint; see `pool.JointPool`."""
        if not jobs:
            return {}
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        for name, job in jobs.items():
            write_data(self.folder / f"{name}{JOB}", {}, job)
        done = dict.fromkeys(jobs, 0.0)

        def take(line: str) -> None:
            with suppress(ValueError, TypeError):  # not of a rank, or torn where many speak at once
                said = json.loads(line)
                done.update({name: float(said[name]) for name in said if name in done})
                progress(done)

        program = [
            *DIE_WITH_PARENT,
            sys.executable,
            "-m",
            "reflowshock.workflow.reflow",
            str(self.folder.resolve()),
            name_of(work),
        ]
        try:
            launch(mpi_command(min(self.count, len(jobs)), program, self.oversubscribe), take, self.folder / "log.txt")
        except LaunchError as error:
            raise self._failure(work, jobs, error) from error
        return {name: self._done(work, name).value for name in jobs}

    def _done(self, work: Callable, name: str) -> Done:
        try:
            done: Done = read_data(self.folder / f"{name}{RESULT}", records_of(work))
        except NotData as error:
            raise ReflowError(f"joint {name}: {error}") from error
        return done

    def _failure(self, work: Callable, jobs: Mapping[str, object], error: LaunchError) -> ReflowError:
        """Say which joint failed and how; where none did, which were under way."""
        ended = [name for name in jobs if (self.folder / f"{name}{RESULT}").exists()]
        for name in ended:
            failed = self._done(work, name).error
            if failed:
                return ReflowError(f"joint {name}: {failed}")
        busy = [name for name in jobs if name not in ended and (self.folder / f"{name}{TAKEN}").exists()]
        return ReflowError(f"{error}; unfinished joints: {', '.join(busy) or 'none'}")
