"""A thread on each rank that ends a run in which nothing goes on, and says who waits for whom.

MPI's waits let other threads of Python run, so the thread sees how long its own rank has been in one wait
(``whereabouts``). What the others do it reads from a file in which each of them says so (``status_board``). It also
hears the signal by which the launcher ends the ranks that are left when one has died, and says which one that was.

It cannot see inside PETSc's solves, nor anything before the first window is done.
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

from reflowshock.fem.parallel.status_board import ERROR, Status, StatusBoard
from reflowshock.fem.parallel.whereabouts import HERE

TICK = 1.0  # [s] between two looks, at most
TICKS = 10  # looks in the time that a wait may last, at least


class Watchdog:
    """The thread of one rank."""

    def __init__(self, world: MPI.Comm, folder: Path, limit: float) -> None:
        """Start to watch; collective.

        Args:
            world: All ranks of the run.
            folder: Which all ranks see.
            limit: How long a wait may last [s].
        """
        HERE.begin(world)
        self._told = folder / ERROR
        if world.rank == 0:  # before any rank can go on and speak
            self._told.unlink(missing_ok=True)
        name = world.bcast(f".watchdog-{os.getpid()}")
        self._rank, self._limit, self._tick = world.rank, limit, min(TICK, limit / TICKS)
        self._board = StatusBoard(folder / name)
        self._board.write(self._status(0.0))
        HERE.tell = lambda: self._board.write(self._status(0.0))
        self._heard, wakeup = os.pipe()
        os.set_blocking(wakeup, False)
        self._wakeup = wakeup
        # The byte is written at once, even while MPI waits; the handler itself would only run after that.
        signal.set_wakeup_fd(wakeup)
        self._handler = signal.signal(signal.SIGTERM, lambda number, frame: None)
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop watching: the run is at its end."""
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGTERM, self._handler)
        os.write(self._wakeup, b"\0")
        self._thread.join()
        self._board.close(self._rank == 0)
        HERE.world, HERE.tell = None, None

    def speak(self, text: str, details: str = "") -> None:
        """Say why the run ends, and from where it could continue, unless another rank has.

        In a file, too: Open MPI 5 loses what ranks write to standard error once one of them has died.
        """
        if self._board.claim():
            words = f"error: {text}{HERE.last_checkpoint}{details}\n"
            self._told.write_text(words, encoding="utf-8")
            sys.stderr.write(words)
            sys.stderr.flush()

    def _watch(self) -> None:
        """Look at each tick until stopped."""
        waited, stopped, latest, before = 0.0, 0.0, -1, time.monotonic()
        while not (heard := self._pause()):
            passed, before = time.monotonic() - before, time.monotonic()
            same = bool(HERE.waiting) and HERE.waits == latest
            latest = HERE.waits
            # A job that was stopped as a whole must not take the time of its rest for a wait.
            passed = min(passed, 2.0 * self._tick)
            waited = waited + passed if same else 0.0
            stopped = stopped + passed if self._stopped() else 0.0
            self._board.write(self._status(waited))
            if waited > self._limit and not self._excuses():
                text = f"a rank has waited longer than {self._limit:g} s (watchdog_seconds), all are ended"
                self._end(text, self._who_waits())
            if stopped > self._limit + 3.0 * self._tick:  # a rank that waits for it has had the time to say so
                names = " and ".join(self._stopped())
                self._end(f"stopped (SIGSTOP) for {self._limit:g} s (watchdog_seconds): {names}; all are ended")
        if heard[0] == signal.SIGTERM:
            self._end(self._who_died())

    def _pause(self) -> bytes:
        """Wait for the next tick; return what was heard meanwhile: a signal, or zero to stop."""
        ready, _, _ = select.select([self._heard], [], [], self._tick)
        return os.read(self._heard, 1) if ready else b""

    def _status(self, waited: float) -> Status:
        """Return what this rank does."""
        who = self._rank, os.getpid(), socket.gethostname(), time.time()
        return Status(*who, HERE.models, HERE.window, HERE.waiting, waited, HERE.slow)

    def _excuses(self) -> bool:
        """Return whether a rank that is alive does something that may take any time."""
        return any(status.slow and time.time() - status.seen < self._limit for status in self._board.read())

    def _stopped(self) -> list[str]:
        """Return the names of ranks of this machine that are stopped: whatever the others do, they will wait."""
        return [status.name for status in self._board.read() if status.is_stopped]

    def _who_waits(self) -> str:
        """Return in words what all ranks do, a line each."""
        lines = [status.describe(2.0 * self._tick + 0.1 * self._limit) for status in self._board.read()]
        return "".join(f"\n  {line}" for line in lines)

    def _who_died(self) -> str:
        """Return in words which ranks are gone."""
        place, died = self._status(0.0).place, [status.name for status in self._board.read() if status.has_died]
        if not died:
            return f"ended by a signal (SIGTERM) {place}"
        return f"{', '.join(died)} {'have' if len(died) > 1 else 'has'} died, all ranks are ended {place}"

    def _end(self, text: str, details: str = "") -> None:
        """Speak, and end this process at once, whatever it waits for; the launcher then ends the others."""
        self.speak(text, details)
        os._exit(1)
