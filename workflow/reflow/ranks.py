"""Reflow of joints on MPI ranks, on any number of machines with a common file system.

Joints are independent, so ranks exchange no messages: jobs, results and checkpoints are data files. Each exchange
starts a new MPI program, which takes a second or two. Waiting ranks would notice the next jobs only after the network
file system has refreshed its listing of the folder (usually 30 s).
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
from reflowshock.workflow.reflow.rank import JOB, RESULT, TAKEN, JobResult, name_of, records_of


@dataclass(frozen=True, slots=True)
class Ranks:
    """MPI ranks as a ``pool.JointPool``; each free rank takes the next job.

    Attributes:
        count: Largest number of ranks.
        oversubscribe: Whether there may be more ranks than cores.
        folder: Folder for jobs and results, visible to all ranks and removed at the end.
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
        """Run the work of each joint; see ``pool.JointPool.run``."""
        if not jobs:
            return {}
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        for name, job in jobs.items():
            write_data(self.folder / f"{name}{JOB}", {}, job)
        shares = dict.fromkeys(jobs, 0.0)

        def read_progress(line: str) -> None:
            with suppress(ValueError, TypeError):  # another output, or lines of several ranks that are mixed
                reported = json.loads(line)
                shares.update({name: float(reported[name]) for name in reported if name in shares})
                progress(shares)

        program = [
            *DIE_WITH_PARENT,
            sys.executable,
            "-m",
            "reflowshock.workflow.reflow",
            str(self.folder.resolve()),
            name_of(work),
        ]
        try:
            command = mpi_command(min(self.count, len(jobs)), program, self.oversubscribe)
            launch(command, read_progress, self.folder / "log.txt")
        except LaunchError as error:
            raise self._failure(work, jobs, error) from error
        return {name: self._result(work, name).value for name in jobs}

    def _result(self, work: Callable, name: str) -> JobResult:
        """Read the result of a joint."""
        try:
            result: JobResult = read_data(self.folder / f"{name}{RESULT}", records_of(work))
        except NotData as error:
            raise ReflowError(f"joint {name}: {error}") from error
        return result

    def _failure(self, work: Callable, jobs: Mapping[str, object], error: LaunchError) -> ReflowError:
        """Return the error with the joint that failed, or else with the joints that are unfinished."""
        ended = [name for name in jobs if (self.folder / f"{name}{RESULT}").exists()]
        for name in ended:
            message = self._result(work, name).error
            if message:
                return ReflowError(f"joint {name}: {message}")
        busy = [name for name in jobs if name not in ended and (self.folder / f"{name}{TAKEN}").exists()]
        return ReflowError(f"{error}; unfinished joints: {', '.join(busy) or 'none'}")
