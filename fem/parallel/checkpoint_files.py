"""Checkpoint files: data with a header of run and window, written atomically.

A checkpoint consists of the files of all ranks at one window, in a folder named after the inputs and the partition.
"""

import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from reflowshock.data_file import NotData, fields_of, read_header, write_data

STATE = "state-{rank:04d}-{generation}"
EXTRA = "{name}-{rank:04d}"
STATE_NAME = re.compile(r"state-(\d{4,})-(\d)")
FOLDER_NAME = re.compile(r"[0-9a-f]{12}-[0-9a-f]{12}")


@dataclass(frozen=True, slots=True)
class Header:
    """Header of a checkpoint file.

    Attributes:
        owner: Digest of the inputs and the code.
        ranks: Number of ranks of the run.
        window: Window at whose end the file was written.
        time: Time at the end of the window [s].
        extras: Names of the additional states that the rank has stored so far.
    """

    owner: str
    ranks: int
    window: int = 0
    time: float = 0.0
    extras: Sequence[str] = ()


@dataclass(frozen=True, order=True)
class Checkpoint:
    """Complete checkpoint; larger ones in the sort order are preferred for a restart.

    Attributes:
        window: Window at whose end it was written.
        preferred: Whether it has the partition of the run.
        folder: Folder of its files.
        generation: Generation of its files, 0 or 1.
        ranks: Number of ranks, which is the number of state files.
        time: Time at the end of the window [s].
    """

    window: int
    preferred: bool
    folder: Path
    generation: int
    ranks: int
    time: float

    @property
    def paths(self) -> list[Path]:
        """State files by rank."""
        return [self.folder / STATE.format(rank=rank, generation=self.generation) for rank in range(self.ranks)]

    def __str__(self) -> str:
        """Return folder, window and time as text."""
        return f"{self.folder} (window {self.window}, time {self.time:.6e} s)"


def find_checkpoints(folder: Path, owner: str, preferred: Path) -> list[Checkpoint]:
    """Return the complete checkpoints of an owner in the subfolders of ``folder``, best first; nothing is written.

    A checkpoint is complete if the state files of all ranks exist. Later windows come first, then the preferred folder.

    Args:
        folder: Folder with one subfolder for each input and partition.
        owner: Digest of the inputs to which a checkpoint must belong.
        preferred: Subfolder of the current partition.

    Returns:
        Records with folder, window, time [s], number of ranks, and whether the partition is the current one.
    """
    by_checkpoint: dict[tuple[Path, int, int], dict[int, Header]] = {}
    for path in sorted(folder.glob("*/state-*")):
        name = STATE_NAME.fullmatch(path.name)
        header = header_of(path) if name else None
        if name and header and header.owner == owner:
            by_checkpoint.setdefault((path.parent, int(name[2]), header.window), {})[int(name[1])] = header
    complete = {
        key: headers for key, headers in by_checkpoint.items() if 0 in headers and len(headers) == headers[0].ranks
    }
    checkpoints = [
        Checkpoint(window, parent == preferred, parent, generation, headers[0].ranks, headers[0].time)
        for (parent, generation, window), headers in complete.items()
    ]
    return sorted(checkpoints, reverse=True)


def header_of(path: Path) -> Header | None:
    """Return the header of a checkpoint file, or print a warning and return None if it is not a checkpoint file.

    Args:
        path: File to be read.

    Returns:
        Digest of the inputs, number of ranks, window and time [s]; None if the file is no checkpoint.
    """
    try:
        return Header(**read_header(path))
    except (NotData, TypeError) as error:
        warn(f"{path} is not a checkpoint file and is ignored: {error}")
    return None


def warn(message: str) -> None:
    """Print a warning to standard output as a JSON line, ``{"warning": message}``, that the launcher displays."""
    print(json.dumps({"warning": message}), flush=True)


def write_state(path: Path, header: Header, state: object) -> None:
    """Write a header and a state to a checkpoint file.

    Args:
        path: File to be written.
        header: Header with owner, ranks, window and time.
        state: Nested dictionaries of plain values and arrays.
    """
    write_data(path, fields_of(header), state)


def digest_of(content: bytes) -> str:
    """Return the SHA-256 digest of some bytes as hexadecimal text."""
    return hashlib.sha256(content).hexdigest()


def digest_of_files(*paths: Path) -> tuple[str, ...]:
    """Return the hexadecimal SHA-256 digest of the content of each file, in the order of the arguments."""
    return tuple(digest_of(path.read_bytes()) for path in paths)
