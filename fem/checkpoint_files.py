"""Files of checkpoints: a line that says what a file is, then a pickled state; written at once or not at all.

A checkpoint is the files of all ranks of a run at one window, in a folder named after inputs and division into ranks.
"""

import hashlib
import json
import os
import pickle
import re
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

STATE = "state-{rank:04d}-{generation}"
STATE_NAME = re.compile(r"state-(\d{4,})-(\d)")
FOLDER_NAME = re.compile(r"[0-9a-f]{12}-[0-9a-f]{12}")


@dataclass(frozen=True, slots=True)
class Header:
    """The first line of a file.

    Attributes:
        owner: Digest of the inputs and the code.
        ranks: How many ranks the run has.
        window: After which it was written, and the ``time`` [s] there.
        sha256: Digest of the state.
    """

    owner: str
    ranks: int
    window: int = 0
    time: float = 0.0
    sha256: str = ""


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
    for path in folder.glob("*/state-*"):
        name, header = STATE_NAME.fullmatch(path.name), read_header(path)
        if name and header and header.owner == owner:
            found.setdefault((path.parent, int(name[2]), header.window), {})[int(name[1])] = header
    complete = {which: headers for which, headers in found.items() if 0 in headers and len(headers) == headers[0].ranks}
    checkpoints = [
        Checkpoint(window, parent == preferred, parent, generation, headers[0].ranks, headers[0].time)
        for (parent, generation, window), headers in complete.items()
    ]
    return sorted(checkpoints, reverse=True)


def read_header(path: Path) -> Header | None:
    """Return the first line of a file, None where it has none."""
    with path.open("rb") as file:
        try:
            return Header(**json.loads(file.readline()))
        except (ValueError, TypeError):
            return None


def read_state(path: Path) -> Any:
    """Return the state in a file that is whole."""
    return pickle.loads(content_of(path))


def content_of(path: Path) -> bytes:
    """Return what follows the header of a file."""
    return path.read_bytes().partition(b"\n")[2]


def is_whole(path: Path) -> bool:
    """Return whether a file has all of its state."""
    header = read_header(path)
    return header is not None and digest_of(content_of(path)) == header.sha256


def write_state(path: Path, header: Header, state: object) -> None:
    """Write a state with its header, whose digest is filled in."""
    content = pickle.dumps(state, pickle.HIGHEST_PROTOCOL)
    line = json.dumps(asdict(replace(header, sha256=digest_of(content))))
    write_at_once(path, line.encode() + b"\n" + content)


def digest_of(content: bytes) -> str:
    """Return the SHA-256 digest of some bytes."""
    return hashlib.sha256(content).hexdigest()


def digest_of_files(*paths: Path) -> tuple[str, ...]:
    """Return the SHA-256 digest of each file."""
    return tuple(digest_of(path.read_bytes()) for path in paths)


def write_at_once(path: Path, content: bytes) -> None:
    """Replace a file; a kill at any moment leaves the old one or the new one."""
    partial = path.with_name(f".{path.name}.partial")
    with partial.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)
