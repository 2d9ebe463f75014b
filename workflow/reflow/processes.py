"""Reflow of several joints at a time in processes of this machine; ``open_pool`` chooses processes or MPI ranks."""

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

POLL = 0.2  # seconds between two updates of the progress

_progress: Any = None  # queue of a worker process, which a pool can only keep in a global variable


class Processes:
    """Processes of this machine as a ``pool.JointPool``; they end with its context."""

    def __init__(self, cores: int, joints: int) -> None:
        """Create the pool.

        Args:
            cores: Largest number of processes; with fewer joints each process has several threads.
            joints: Number of joints of an exchange.
        """
        workers = max(1, min(cores, joints))
        self._reports = SPAWN.Queue()
        self._pool = ProcessPool(workers, _start_worker, (self._reports, max(1, cores // workers)))

    def __enter__(self) -> "Processes":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for the processes, or end them after an error."""
        self._pool.__exit__(kind, error, trace)

    def run(
        self, work: Callable[[Job, Report], Result], jobs: Mapping[str, Job], progress: Callable[[Shares], None]
    ) -> dict[str, Result]:
        """Run the work of each joint; see ``pool.JointPool.run``."""
        futures = {self._pool.submit(_work, work, name, job): name for name, job in jobs.items()}
        self._wait(futures, progress)
        return {name: future.result() for future, name in futures.items()}

    def _wait(self, futures: Mapping[Future, str], progress: Callable[[Shares], None]) -> None:
        """Wait for all jobs and report their progress; raise as soon as one fails."""
        shares = dict.fromkeys(futures.values(), 0.0)
        pending: Sequence[Future] | set[Future] = set(futures)
        while pending:
            finished, pending = wait(pending, POLL, FIRST_COMPLETED)
            self._take_reports(shares)
            for future in finished:
                error = future.exception()
                if isinstance(error, BrokenProcessPool):
                    raise ReflowError(f"joint {futures[future]}: its process has ended with {self._pool.ending()}")
                if error is not None:
                    raise ReflowError(f"joint {futures[future]}: {type(error).__name__}: {error}") from error
                shares[futures[future]] = 1.0
            progress(shares)

    def _take_reports(self, shares: dict[str, float]) -> None:
        """Update the fraction done of each joint from the queue."""
        while True:
            try:
                name, fraction = self._reports.get_nowait()
            except queue.Empty:
                return
            if name in shares:  # late reports of the previous exchange are ignored
                shares[name] = max(shares[name], fraction)


def _start_worker(reports: Any, threads: int) -> None:
    global _progress
    os.environ["NUMBA_NUM_THREADS"] = str(threads)  # before numba is loaded, which would use all cores
    _progress = reports


def _work(work: Callable[[Any, Report], Result], name: str, job: Any) -> Result:
    return work(job, lambda fraction: _progress.put((name, fraction)))


def open_pool(run: Run[PackageCase], joints: int) -> JointPool:
    """Return MPI ranks if the case sets ``reflow.ranks``, otherwise processes of this machine.

    Args:
        run: Case, cores and folder of the checkpoints.
        joints: Number of joints of an exchange.

    Returns:
        Pool to be used as a context, which runs up to ``joints`` jobs at a time.
    """
    ranks = run.case.reflow.ranks
    if ranks is None:
        return Processes(run.cores, joints)
    return Ranks(ranks, run.oversubscribe, run.checkpoints("reflow") / "ranks.jobs")
