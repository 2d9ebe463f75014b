"""Watchdog thread of each rank, which ends a deadlocked run and reports which rank waits for which.

MPI waits release Python's interpreter lock, so the thread can measure the duration of its rank's current wait
(``rank_activity``). It reads the status of the other ranks from a shared file (``status_board``). It also receives the
signal with which the launcher ends the remaining ranks after one has died, and reports the dead rank.

It does not monitor PETSc solves or anything before the end of the first window.
"""

import os
import select
import signal
import socket
import sys
import threading
import time
from pathlib import Path

from mpi4py import MPI

from reflowshock.fem.parallel.rank_activity import ACTIVITY
from reflowshock.fem.parallel.status_board import ERROR, Status, StatusBoard

TICK = 1.0  # largest interval between two checks [s]
TICKS = 10  # smallest number of checks within the longest allowed wait


class Watchdog:
    """Watchdog thread of one rank."""

    def __init__(self, world: MPI.Comm, folder: Path, limit: float) -> None:
        """Start the thread; collective.

        Args:
            world: Communicator of all ranks of the run.
            folder: Folder that is accessible to all ranks.
            limit: Longest allowed wait [s].
        """
        ACTIVITY.begin(world)
        self._error_file = folder / ERROR
        if world.rank == 0:  # before any rank can report an error
            self._error_file.unlink(missing_ok=True)
        name = world.bcast(f".watchdog-{os.getpid()}")
        self._rank, self._limit, self._tick = world.rank, limit, min(TICK, limit / TICKS)
        self._board = StatusBoard(folder / name)
        self._board.write(self._status(0.0))
        ACTIVITY.publish = lambda: self._board.write(self._status(0.0))
        self._signals, wakeup = os.pipe()
        os.set_blocking(wakeup, False)
        self._wakeup = wakeup
        # The byte is written immediately, even during an MPI wait; the handler itself would run only after the wait.
        signal.set_wakeup_fd(wakeup)
        self._handler = signal.signal(signal.SIGTERM, lambda number, frame: None)
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop the thread at the end of the run."""
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGTERM, self._handler)
        os.write(self._wakeup, b"\0")
        self._thread.join()
        self._board.close(self._rank == 0)
        ACTIVITY.world, ACTIVITY.publish = None, None

    def speak(self, text: str, details: str = "") -> None:
        """Report why the run ends and its last checkpoint, unless another rank has already reported.

        The message is also written to a file, since Open MPI 5 loses standard error after a rank has died.
        """
        if self._board.claim():
            message = f"error: {text}{ACTIVITY.last_checkpoint}{details}\n"
            self._error_file.write_text(message, encoding="utf-8")
            sys.stderr.write(message)
            sys.stderr.flush()

    def _watch(self) -> None:
        """Check the ranks at each tick until stopped."""
        waited, stopped, latest, last_check = 0.0, 0.0, -1, time.monotonic()
        while not (received := self._pause()):
            passed, last_check = time.monotonic() - last_check, time.monotonic()
            same = bool(ACTIVITY.waiting) and ACTIVITY.waits == latest
            latest = ACTIVITY.waits
            # If the whole job was stopped, the pause does not count as a wait.
            passed = min(passed, 2.0 * self._tick)
            waited = waited + passed if same else 0.0
            stopped = stopped + passed if self._stopped() else 0.0
            self._board.write(self._status(waited))
            if waited > self._limit and not self._excuses():
                text = f"a rank has waited longer than {self._limit:g} s (watchdog_seconds); all ranks are ended"
                self._end(text, self._all_statuses())
            if stopped > self._limit + 3.0 * self._tick:  # ranks that wait for it report first
                names = " and ".join(self._stopped())
                self._end(f"stopped (SIGSTOP) for {self._limit:g} s (watchdog_seconds): {names}; all ranks are ended")
        if received[0] == signal.SIGTERM:
            self._end(self._dead_ranks())

    def _pause(self) -> bytes:
        """Wait for the next tick; return a signal number received meanwhile, zero to stop, or nothing."""
        ready, _, _ = select.select([self._signals], [], [], self._tick)
        return os.read(self._signals, 1) if ready else b""

    def _status(self, waited: float) -> Status:
        """Return the status of this rank."""
        identity = self._rank, os.getpid(), socket.gethostname(), time.time()
        return Status(*identity, ACTIVITY.models, ACTIVITY.window, ACTIVITY.waiting, waited, ACTIVITY.slow)

    def _excuses(self) -> bool:
        """Return whether a rank that is alive runs an operation of unlimited duration."""
        return any(status.slow and time.time() - status.seen < self._limit for status in self._board.read())

    def _stopped(self) -> list[str]:
        """Return the names of stopped ranks on this machine, for which all others will wait."""
        return [status.name for status in self._board.read() if status.is_stopped]

    def _all_statuses(self) -> str:
        """Return the status of all ranks as text, one line each."""
        lines = [status.describe(2.0 * self._tick + 0.1 * self._limit) for status in self._board.read()]
        return "".join(f"\n  {line}" for line in lines)

    def _dead_ranks(self) -> str:
        """Return a sentence with the ranks that have died."""
        position = self._status(0.0).position
        died = [status.name for status in self._board.read() if status.has_died]
        if not died:
            return f"ended by a signal (SIGTERM) {position}"
        return f"{', '.join(died)} {'have' if len(died) > 1 else 'has'} died, all ranks are ended {position}"

    def _end(self, text: str, details: str = "") -> None:
        """Report, and end this process immediately; the launcher then ends the others."""
        self.speak(text, details)
        os._exit(1)
