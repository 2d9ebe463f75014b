"""Processes that try hard cases, several at a time; one that does not answer in time is ended, and the rest goes on."""

import contextlib
import math
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any

from reflowshock.fem.parallel.own_job import end_with_parent
from reflowshock.workflow.stress_test.hard_case import HardCase
from reflowshock.workflow.stress_test.verdict import Verdict, attempt


@dataclass(slots=True)
class _Worker:
    """A process, the end of its pipe, and what it works on since when [s]; it says once that it has started."""

    process: Any
    pipe: Connection
    case: HardCase | None = None
    since: float = math.inf
    has_started: bool = False

    @property
    def left(self) -> float:
        """Seconds until its case is taken to hang."""
        return self.since + self.case.deadline - time.monotonic() if self.case else math.inf

    def give(self, case: HardCase) -> None:
        """Let it try a case."""
        self.case, self.since = case, time.monotonic() if self.has_started else math.inf
        self.pipe.send(case)

    def start(self) -> None:
        """Take note that it has started, and with what it was given."""
        self.has_started, self.since = True, time.monotonic()

    def end(self) -> None:
        """End the process and all that it started, at once."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()  # it may not lead a group yet
        self.process.join()
        self.pipe.close()


class Pool:
    """Processes of this machine, of one thread each; they live as long as it is entered."""

    def __init__(self, processes: int) -> None:
        """Prepare as many processes; they start when they have work."""
        self._processes = processes
        self._context = multiprocessing.get_context("spawn")
        self._workers: list[_Worker] = []

    def __enter__(self) -> "Pool":
        return self

    def __exit__(self, *_: object) -> None:
        """End all processes, whatever they do."""
        for worker in self._workers:
            worker.end()
        self._workers.clear()

    def attempt(self, cases: Iterable[HardCase]) -> Iterator[Verdict]:
        """Try cases and yield their verdicts as they come."""
        waiting = deque(cases)
        while waiting or any(worker.case for worker in self._workers):
            while waiting and (worker := self._idle()) is not None:
                worker.give(waiting.popleft())
            yield from self._answers()

    def _idle(self) -> _Worker | None:
        """A process without work, a new one where more may be started or one has ended, as by lack of memory."""
        self._workers = [worker for worker in self._workers if worker.case or worker.process.is_alive()]
        idle = next((worker for worker in self._workers if worker.case is None), None)
        if idle is None and len(self._workers) < self._processes:
            idle = self._start()
        return idle

    def _start(self) -> _Worker:
        """Start a process; an interrupt waits until it is known, and does not reach it."""
        ours, theirs = self._context.Pipe()
        process = self._context.Process(target=_work, args=(theirs,))
        worker = _Worker(process, ours)
        resource_tracker.ensure_running()  # to start it would let signals through again
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            process.start()
            self._workers.append(worker)
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        theirs.close()
        return worker

    def _answers(self) -> Iterator[Verdict]:
        """Wait until a process answers, ends or is overdue, and yield the verdicts."""
        busy = {worker.pipe: worker for worker in self._workers if worker.case}
        left = min(worker.left for worker in busy.values())
        ready = wait(list(busy), None if left == math.inf else max(0.0, left))
        for pipe, worker in busy.items():
            case = worker.case
            if pipe in ready and (verdict := self._answer(worker)) is not None:
                yield verdict
            elif case is not None and worker.left <= 0.0:
                yield self._given_up(worker, f"no answer in {case.deadline:g} s: taken to hang")

    def _answer(self, worker: _Worker) -> Verdict | None:
        """Take what a process says: its verdict, or none where it has started."""
        try:
            said = worker.pipe.recv()
        except (EOFError, ConnectionResetError):
            worker.process.join()
            return self._given_up(worker, f"the process ended with code {worker.process.exitcode}")
        if said is None:
            worker.start()
        else:
            worker.case = None
        return said

    def _given_up(self, worker: _Worker, message: str) -> Verdict:
        """The verdict on a case without an answer; its process is ended, another takes its place."""
        case, seconds = worker.case, max(0.0, time.monotonic() - worker.since)
        assert case is not None
        self._workers.remove(worker)
        worker.end()
        return Verdict(case, (), message, seconds=seconds)


def _work(pipe: Connection) -> None:
    """Try what comes through a pipe until it is closed; what solvers print is left out."""
    os.setsid()  # its parent ends it with all that it starts
    threading.Thread(target=end_with_parent, daemon=True).start()
    os.environ["NUMBA_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    pipe.send(None)
    while True:
        try:
            case = pipe.recv()
        except EOFError:
            return
        pipe.send(attempt(case))
