"""Checkpoints of a run on all its ranks: two generations, each written at once or not at all.

Every rank has files of its own. A run continues from the latest window of which all ranks have a whole file of the same
inputs, ranks and code; the other generation is there for a kill between two ranks' files. As in every pickle, a file
from a stranger must not be read.
"""

import hashlib
import os
import pickle
from functools import cache
from importlib.metadata import version
from pathlib import Path
from time import monotonic
from typing import Any

from mpi4py import MPI

LIBRARIES = ("numpy", "scipy", "numba")
GENERATIONS = 2


class Checkpoints:
    """The checkpoint files of one run.

    Attributes:
        continued: Window from which the run continued, None where it began anew.
    """

    def __init__(self, comm: MPI.Comm, folder: Path | None, inputs: object, interval: float) -> None:
        """Name what the files belong to; collective.

        Args:
            comm: All ranks of the run.
            folder: Where the files are; None for a run without checkpoints.
            inputs: All that the run depends on; plain data whose ``repr`` tells all of it, equal on all ranks.
            interval: Wall time between two checkpoints [s].
        """
        self._comm, self._folder, self._interval = comm, folder, interval
        self.continued: int | None = None
        self._owner = hashlib.sha256(repr((inputs, comm.rank, comm.size)).encode() + _code()).digest()
        self._written, self._generation = monotonic(), 0
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)

    def read(self) -> Any | None:
        """Return this rank's state at the latest window that all ranks have, None where there is none; collective."""
        mine = {} if self._folder is None else self._whole_files(self._folder)
        common = set.intersection(*(set(windows) for windows in self._comm.allgather(list(mine))))
        if not common:
            return None
        self.continued = max(common)
        generation, state = mine[self.continued]
        self._generation = (generation + 1) % GENERATIONS
        return pickle.loads(state)

    def is_due(self) -> bool:
        """Return whether the interval has passed on rank 0; collective."""
        if self._folder is None:
            return False
        return bool(self._comm.bcast(monotonic() - self._written >= self._interval))

    def write(self, window: int, state: object) -> None:
        """Write this rank's state at a window over the older generation; collective."""
        if self._folder is None:
            return
        content = pickle.dumps((window, pickle.dumps(state, pickle.HIGHEST_PROTOCOL)))
        write_at_once(self._path(self._folder, self._generation), self._owner + digest_of(content) + content)
        self._generation = (self._generation + 1) % GENERATIONS
        self._comm.Barrier()  # no rank may overwrite its older file before all have the newer one
        self._written = monotonic()

    def keep(self, name: str, value: object) -> None:
        """Keep something for the rest of the run, beside the state; of this rank."""
        if self._folder is not None:
            content = pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
            write_at_once(self._folder / f"{name}-{self._comm.rank:04d}", content)

    def kept(self, name: str) -> Any:
        """Return what ``keep`` kept before the window from which this run continues."""
        assert self._folder is not None
        return pickle.loads((self._folder / f"{name}-{self._comm.rank:04d}").read_bytes())

    def _path(self, folder: Path, generation: int) -> Path:
        return folder / f"state-{self._comm.rank:04d}-{generation}"

    def _whole_files(self, folder: Path) -> dict[int, tuple[int, bytes]]:
        """Return window -> generation and pickled state of this rank's files that are whole and of this run."""
        found = {}
        size = len(self._owner)
        for generation in range(GENERATIONS):
            path = self._path(folder, generation)
            data = path.read_bytes() if path.exists() else b""
            owner, digest, content = data[:size], data[size : 2 * size], data[2 * size :]
            if owner == self._owner and digest == digest_of(content):
                window, state = pickle.loads(content)
                found[window] = (generation, state)
        return found


def digest_of(content: bytes) -> bytes:
    """Return the SHA-256 digest of some bytes."""
    return hashlib.sha256(content).digest()


def digest_of_files(*paths: Path) -> tuple[str, ...]:
    """Return the SHA-256 digest of each file."""
    return tuple(hashlib.sha256(path.read_bytes()).hexdigest() for path in paths)


def write_at_once(path: Path, content: bytes) -> None:
    """Replace a file; a kill at any moment leaves the old one or the new one."""
    partial = path.with_name(f".{path.name}.partial")
    with partial.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)


@cache
def _code() -> bytes:
    """Return a digest of this package's source and of the libraries: other code may continue a state differently."""
    digest = hashlib.sha256(" ".join(version(name) for name in LIBRARIES).encode())
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()
