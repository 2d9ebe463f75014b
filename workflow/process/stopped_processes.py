"""A thread that ends a program of which one process is stopped: the others would wait for it in silence, for ever.

MPI's waits, PETSc's solves and what comes before the first time step have no clock of their own; the system knows which
process is stopped (SIGSTOP, a debugger that was left). It sees the processes of this machine.
"""

import os
import signal
import threading
from contextlib import suppress
from pathlib import Path
from types import TracebackType

PATIENCE = 60.0  # [s] that a process may be stopped
TICK = 1.0  # [s] between two looks
STOPPED = "T"
RANK = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", "SLURM_PROCID")  # variables with the number of an MPI rank
PROC = Path("/proc")


class StoppedProcesses:
    """Looks, while its block lasts, whether a process or one of its descendants is stopped; kills those that stay so.

    Attributes:
        told: which it was and how long, in words; empty before that.
    """

    def __init__(self, process: int, patience: float = PATIENCE) -> None:
        """Take the process id, and how long one may be stopped [s]."""
        self.told = ""
        self._process, self._patience = process, patience
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> "StoppedProcesses":
        self._thread.start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Look no longer."""
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        """Count looks, not seconds: while all is stopped, this one included, nobody waits."""
        looks: dict[int, int] = {}
        tick = min(TICK, self._patience / 4)
        while not self._over.wait(tick):
            looks = {process: looks.get(process, 0) + 1 for process in stopped(self._process)}
            late = [process for process, count in looks.items() if count * tick > self._patience]
            if late:
                names = " and ".join(name(process) for process in late)
                self.told = f"{names} had been stopped (SIGSTOP) for {self._patience:g} s, so the run was ended"
                for process in late:
                    with suppress(OSError):
                        os.kill(process, signal.SIGKILL)


def stopped(root: int) -> list[int]:
    """Return the processes that are stopped, of one and all that it started, directly or not."""
    parents: dict[int, int] = {}
    halted = []
    for folder in PROC.iterdir():
        if not folder.name.isdigit():
            continue
        try:
            said = (folder / "stat").read_text(encoding="utf-8", errors="replace")
        except OSError:  # it has ended meanwhile
            continue
        state, parent = said.rpartition(")")[2].split()[:2]
        parents[int(folder.name)] = int(parent)
        if state == STOPPED:
            halted.append(int(folder.name))
    return [process for process in halted if _descends(process, root, parents)]


def _descends(process: int, root: int, parents: dict[int, int]) -> bool:
    while process > 1 and process != root:
        process = parents.get(process, 0)
    return process == root


def name(process: int) -> str:
    """Return the name of a process in words: that of an MPI rank, where it is one."""
    with suppress(OSError):
        variables = (PROC / str(process) / "environ").read_bytes().split(b"\0")
        known = dict(os.fsdecode(one).partition("=")[::2] for one in variables)
        number = next((known[key] for key in RANK if key in known), None)
        if number is not None:
            return f"rank {number} (process {process})"
    return f"process {process}"
