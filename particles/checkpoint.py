"""Checkpoint of a run in one file: written at once or not at all, read only if it belongs to the same inputs and code.

The state is pickled whole: whatever an effect adds to it is in the file without being listed anywhere, and shared
objects stay shared, so that the run continues to the last bit. A digest finds truncated files; like every pickle,
a file from a stranger must not be read.
"""

import hashlib
import logging
import os
import pickle
from collections.abc import Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from time import monotonic
from typing import Any

logger = logging.getLogger(__name__)

INTERVAL = 1.0
LIBRARIES = ("numpy", "scipy", "numba", "petsc4py")


class Checkpoint:
    """The checkpoint file of one run.

    Attributes:
        continued: whether the run continued from this file.
    """

    def __init__(self, path: Path, inputs: Sequence[object], interval: float = INTERVAL) -> None:
        """Name the file and what it belongs to.

        Args:
            path: file; its folder is made when it is first written.
            inputs: all that the run depends on; plain data, whose `repr` tells all of it.
            interval: wall time between two checkpoints [s].
        """
        self.path, self.interval, self.continued = path, interval, False
        self._owner = hashlib.sha256(repr(inputs).encode() + _code()).digest()
        self._written = monotonic()

    def read(self) -> Any | None:
        """Return the state; None where there is none, or, with a warning, where it is broken or of another run."""
        if not self.path.exists():
            return None
        content = self.path.read_bytes()
        size = len(self._owner)
        owner, digest, state = content[:size], content[size : 2 * size], content[2 * size :]
        if hashlib.sha256(state).digest() != digest:
            logger.warning("%s is broken off: the run starts anew", self.path)
            return None
        if owner != self._owner:
            logger.warning("%s belongs to other inputs or another version: the run starts anew", self.path)
            return None
        self.continued = True
        return pickle.loads(state)

    def is_due(self) -> bool:
        """Whether the interval has passed."""
        return monotonic() - self._written >= self.interval

    def write(self, state: object) -> None:
        """Replace the file; a kill at any moment leaves the old one or the new one."""
        content = pickle.dumps(state, pickle.HIGHEST_PROTOCOL)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        partial = self.path.with_name(f"{self.path.name}.{os.getpid()}.partial")
        with partial.open("wb") as file:
            file.write(self._owner + hashlib.sha256(content).digest() + content)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(self.path)
        _sync(self.path.parent)
        self._written = monotonic()


def _sync(folder: Path) -> None:
    """Make a rename in a folder last."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@cache
def _code() -> bytes:
    """Digest of this package's source and of the libraries: other code would read or continue a state differently."""
    digest = hashlib.sha256(" ".join(version(name) for name in LIBRARIES).encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()
