"""The one pool of processes: `concurrent.futures`, and nothing is left behind by an error, an interrupt or a kill."""

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
    """Processes for a block: its end waits for them, an error or an interrupt in it kills them.

    They also end when this process is killed. Only this process takes note of Ctrl-C, and then leaves the block.
    """

    def __init__(self, workers: int, initializer: Callable[..., Any] | None = None, initargs: tuple = ()) -> None:
        """Take the number of processes, and what each calls first, with which arguments."""
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
        """Say how the processes of a broken pool have ended."""
        processes = self._own()
        self.shutdown()  # its thread reaps them: whoever also waits for one may be told no exit code
        # The pool itself terminates the others.
        code = next((one.exitcode for one in processes if one.exitcode not in (0, -signal.SIGTERM)), None)
        killed = ": it was killed, as the system does when memory is short" if code == -signal.SIGKILL else ""
        return f"exit code {code}{killed}"

    def _kill(self) -> None:
        for process in self._own():
            process.kill()

    def _own(self) -> list[Any]:
        """Return the processes, which are public from Python 3.14 on only (``kill_workers``)."""
        return list((self._processes or {}).values())


def _begin(initializer: Callable[..., Any] | None, initargs: tuple) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if initializer is not None:
        initializer(*initargs)


def _end_with_parent() -> None:
    """Wait until the parent has ended, then end this process: it would compete with those of the run that continues."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
