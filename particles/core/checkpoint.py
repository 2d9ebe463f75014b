"""Checkpoint of a run in one file: written at once or not at all, read only if it belongs to the same inputs and code.

A state is data (`data_file.py`): what has one says of which arrays, numbers and records it consists, and how it is made
of them again, so that the run continues to the last bit. Nothing in a file is executed, whoever has written it.
"""

import hashlib
import logging
from collections.abc import Collection, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from time import monotonic
from typing import Any

from reflowshock.data_file import NotData, read_data, read_header, write_data
from reflowshock.sources import MATERIALS, digest_of_sources

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
        self._owner = hashlib.sha256(repr(inputs).encode() + _code()).hexdigest()
        self._written = monotonic()

    def read(self, records: Collection[type] = ()) -> Any | None:
        """Return the state; None where there is none, or, with a warning, where it is broken or of another run.

        Args:
            records: dataclasses that it may consist of; no others are made.
        """
        if not self.path.exists():
            return None
        try:
            owner = read_header(self.path).get("owner")
            state = read_data(self.path, records) if owner == self._owner else None
        except NotData as error:
            logger.warning("%s: the run starts anew", error)
            return None
        if owner != self._owner:
            logger.warning("%s belongs to other inputs or another version: the run starts anew", self.path)
            return None
        self.continued = True
        return state

    def is_due(self) -> bool:
        """Whether the interval has passed."""
        return monotonic() - self._written >= self.interval

    def write(self, state: object) -> None:
        """Replace the file by a state that is data; a kill at any moment leaves the old one or the new one."""
        write_data(self.path, {"owner": self._owner}, state)
        self._written = monotonic()


@cache
def _code() -> bytes:
    """Digest of this package's source and of the libraries: other code would read or continue a state differently."""
    libraries = " ".join(version(name) for name in LIBRARIES)
    return libraries.encode() + digest_of_sources(Path(__file__).parents[1], MATERIALS)
