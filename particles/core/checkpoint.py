"""Checkpoint of a run in one file: written atomically, and read only if it belongs to the same inputs and code.

A state consists of plain data (``data_file.py``): arrays, numbers and records, from which the run continues with
identical bits. No content of a file is executed.
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

# Wall time between two checkpoints [s].
INTERVAL = 1.0
LIBRARIES = ("numpy", "scipy", "numba", "petsc4py")


class Checkpoint:
    """The checkpoint file of one run.

    Attributes:
        continued: Whether the run continued from this file.
    """

    def __init__(self, path: Path, inputs: Sequence[object], interval: float = INTERVAL) -> None:
        """Set the file and the inputs to which it belongs.

        Args:
            path: File; its folder is created with the first checkpoint.
            inputs: All inputs of the run; plain data with a complete ``repr``.
            interval: Wall time between two checkpoints [s].
        """
        self.path, self.interval, self.continued = path, interval, False
        self._owner = hashlib.sha256(repr(inputs).encode() + _code()).hexdigest()
        self._written = monotonic()

    def read(self, records: Collection[type] = ()) -> Any | None:
        """Return the saved state, or None without a file; a damaged or foreign file is ignored with a warning.

        Args:
            records: Dataclasses that the state may contain; no others are created.
        """
        if not self.path.exists():
            return None
        try:
            owner = read_header(self.path).get("owner")
            state = read_data(self.path, records) if owner == self._owner else None
        except NotData as error:
            logger.warning("%s: the run starts from the beginning", error)
            return None
        if owner != self._owner:
            logger.warning(
                "%s belongs to other inputs or another version: the run starts from the beginning", self.path
            )
            return None
        self.continued = True
        return state

    def is_due(self) -> bool:
        """Return whether the interval has passed."""
        return monotonic() - self._written >= self.interval

    def write(self, state: object) -> None:
        """Replace the file atomically: an interrupt leaves either the old or the new checkpoint."""
        write_data(self.path, {"owner": self._owner}, state)
        self._written = monotonic()


@cache
def _code() -> bytes:
    """Return a digest of this package's source and of the library versions, with which results may differ."""
    libraries = " ".join(version(name) for name in LIBRARIES)
    return libraries.encode() + digest_of_sources(Path(__file__).parents[1], MATERIALS)
