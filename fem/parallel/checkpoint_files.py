"""Files of checkpoints: data with a header that says which run and window they are of; written at once or not at all.

A checkpoint is the files of all ranks of a run at one window, in a folder named after inputs and division into ranks.
"""

import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from reflowshock.data_file import NotData, fields_of, read_header, write_data

STATE = "state-{rank:04d}-{generation}"
KEPT = "{name}-{rank:04d}"
STATE_NAME = re.compile(r"state-(\d{4,})-(\d)")
FOLDER_NAME = re.compile(r"[0-9a-f]{12}-[0-9a-f]{12}")


@dataclass(frozen=True, slots=True)
class Header:
    """What a file is.

    Attributes:
        owner: Digest of the inputs and the code.
        ranks: How many ranks the run has.
        window: After which it was written, and the ``time`` [s] there.
        kept: Names of what the rank has kept in files of their own until then.
    """

    owner: str
    ranks: int
    window: int = 0
    time: float = 0.0
    kept: Sequence[str] = ()


@dataclass(frozen=True, order=True)
class Checkpoint:
    """A checkpoint of which all files are there; the order is that in which a run would continue from them.

    Attributes:
        window: After which it was written.
        preferred: Whether it is of the division into ranks that the run has.
        folder: Of its files.
        generation: Of its files.
        ranks: Number of files.
        time: [s].
    """

    window: int
    preferred: bool
    folder: Path
    generation: int
    ranks: int
    time: float

    @property
    def paths(self) -> list[Path]:
        """Return its files, by rank."""
        return [self.folder / STATE.format(rank=rank, generation=self.generation) for rank in range(self.ranks)]

    def __str__(self) -> str:
        """Say where it is and of when."""
        return f"{self.folder} (window {self.window}, time {self.time:.6e} s)"


def find_checkpoints(folder: Path, owner: str, preferred: Path) -> list[Checkpoint]:
    """Return the checkpoints of an owner in the subfolders of ``folder``, best first, by the headers of their files."""
    found: dict[tuple[Path, int, int], dict[int, Header]] = {}
    for path in sorted(folder.glob("*/state-*")):
        name = STATE_NAME.fullmatch(path.name)
        header = header_of(path) if name else None
        if name and header and header.owner == owner:
            found.setdefault((path.parent, int(name[2]), header.window), {})[int(name[1])] = header
    complete = {which: headers for which, headers in found.items() if 0 in headers and len(headers) == headers[0].ranks}
    checkpoints = [
        Checkpoint(window, parent == preferred, parent, generation, headers[0].ranks, headers[0].time)
        for (parent, generation, window), headers in complete.items()
    ]
    return sorted(checkpoints, reverse=True)


def header_of(path: Path) -> Header | None:
    """Return the header of a file; None, with a warning, where it has none."""
    try:
        return Header(**read_header(path))
    except (NotData, TypeError) as error:
        warn(f"{path} is no file of a checkpoint and is not used: {error}")
    return None


def warn(what: str) -> None:
    """Tell the launcher, which shows it, what is wrong and what comes of it."""
    print(json.dumps({"warning": what}), flush=True)


def write_state(path: Path, header: Header, state: object) -> None:
    """Write a state with its header."""
    write_data(path, fields_of(header), state)


def digest_of(content: bytes) -> str:
    """Return the SHA-256 digest of some bytes."""
    return hashlib.sha256(content).hexdigest()


def digest_of_files(*paths: Path) -> tuple[str, ...]:
    """Return the SHA-256 digest of each file."""
    return tuple(digest_of(path.read_bytes()) for path in paths)
