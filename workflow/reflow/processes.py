"""Processes that bring joints to rest, several joints at a time; `open_pool` chooses them or MPI ranks."""

import os
import queue
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from types import TracebackType
from typing import Any

from reflowshock.processes import SPAWN, ProcessPool
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package.case import PackageCase
from reflowshock.workflow.reflow.pool import Job, JointPool, ReflowError, Report, Result, Shares
from reflowshock.workflow.reflow.ranks import Ranks

POLL = 0.2  # seconds between two looks at the progress

_progress: Any = None  # the queue of a worker process: a pool has no other place for it


class Processes:
    """Processes of this machine, a `pool.JointPool`; they live as long as it is entered."""

    def __init__(self, cores: int, joints: int) -> None:
        """Prepare the processes.

        Args:
            cores: how many processes at most; with fewer joints each has several threads.
            joints: how many there are to compute at a time.
        """
        workers = max(1, min(cores, joints))
        self._reports = SPAWN.Queue()
        self._pool = ProcessPool(workers, _start_worker, (self._reports, max(1, cores // workers)))

    def __enter__(self) -> "Processes":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for the processes; where something failed, end them."""
        self._pool.__exit__(kind, error, trace)

    def run(
        self, work: Callable[[Job, Report], Result], jobs: Mapping[str, Job], progress: Callable[[Shares], None]
    ) -> dict[str, Result]:
        """Do a piece of work for each joint; see `pool.JointPool`."""
        futures = {self._pool.submit(_work, work, name, job): name for name, job in jobs.items()}
        self._wait(futures, progress)
        return {name: future.result() for future, name in futures.items()}

    def _wait(self, futures: Mapping[Future, str], progress: Callable[[Shares], None]) -> None:
        """Wait for all jobs, passing on how far they are; raise as soon as one fails."""
        done = dict.fromkeys(futures.values(), 0.0)
        pending: Sequence[Future] | set[Future] = set(futures)
        while pending:
            finished, pending = wait(pending, POLL, FIRST_COMPLETED)
            self._take_reports(done)
            for future in finished:
                error = future.exception()
                if isinstance(error, BrokenProcessPool):
                    raise ReflowError(f"joint {futures[future]}: its process has ended with {self._pool.ending()}")
                if error is not None:
                    raise ReflowError(f"joint {futures[future]}: {type(error).__name__}: {error}") from error
                done[futures[future]] = 1.0
            progress(done)

    def _take_reports(self, done: dict[str, float]) -> None:
        while True:
            try:
                name, fraction = self._reports.get_nowait()
            except queue.Empty:
                return
            if name in done:  # else a late word of an exchange before
                done[name] = max(done[name], fraction)


def _start_worker(reports: Any, threads: int) -> None:
    global _progress
    os.environ["NUMBA_NUM_THREADS"] = str(threads)  # numba, which is loaded after this, would take all cores
    _progress = reports


def _work(work: Callable[[Any, Report], Result], name: str, job: Any) -> Result:
    return work(job, lambda fraction: _progress.put((name, fraction)))


def open_pool(run: Run[PackageCase], joints: int) -> JointPool:
    """Return MPI ranks where the case asks for them, else processes on the cores of this machine.

    Args:
        run: case, cores, where checkpoints are.
        joints: how many there are to compute at a time.
    """
    ranks = run.case.reflow.ranks
    if ranks is None:
        return Processes(run.cores, joints)
    return Ranks(ranks, run.oversubscribe, run.checkpoints("reflow") / "ranks.jobs")
