"""Process pool based on ``concurrent.futures`` that leaves no process behind after an error, interrupt or kill."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from types import TracebackType
from typing import Any

SPAWN = multiprocessing.get_context("spawn")  # a fork would share locks, threads and MPI with this process


class ProcessPool(ProcessPoolExecutor):
    """Process pool of a block: its end waits for the processes, an error or interrupt kills them.

    The processes also end when this process is killed. They ignore Ctrl-C, which this process handles.
    """

    def __init__(self, workers: int, initializer: Callable[..., Any] | None = None, initargs: tuple = ()) -> None:
        """Store the number of processes and the function, with arguments, that each calls first."""
        super().__init__(workers, SPAWN, _begin, (initializer, initargs))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for the processes; kill them if something failed."""
        if kind is not None:
            self._kill()
        try:
            self.shutdown(wait=True, cancel_futures=kind is not None)
        except BaseException:  # a signal while it waits
            self._kill()
            raise

    def ending(self) -> str:
        """Describe how the processes of a broken pool ended."""
        processes = self._worker_processes()
        self.shutdown()  # its thread reaps the processes; a second wait could miss the exit code
        # The pool itself terminates the remaining processes with SIGTERM.
        code = next((process.exitcode for process in processes if process.exitcode not in (0, -signal.SIGTERM)), None)
        killed = ": it was killed, as the system does when memory is short" if code == -signal.SIGKILL else ""
        return f"exit code {code}{killed}"

    def _kill(self) -> None:
        for process in self._worker_processes():
            process.kill()

    def _worker_processes(self) -> list[Any]:
        """Return the processes, which have no public interface before Python 3.14 (``kill_workers``)."""
        return list((self._processes or {}).values())


def _begin(initializer: Callable[..., Any] | None, initargs: tuple) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if initializer is not None:
        initializer(*initargs)


def _end_with_parent() -> None:
    """Wait for the end of the parent, then end this process, which would compete with a continued run."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
