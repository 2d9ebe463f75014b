"""How far a stage is, in a file that a second terminal reads: what goes on, the share that is done, since when."""

import json
import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

NAME = "progress.json"
INTERVAL = 1.0  # s between two writes
VARIABLE = "REFLOWSHOCK_PROGRESS"  # names the file, for what a stage starts, too


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a stage is.

    Attributes:
        what: in words.
        share: 0 to 1.
        seconds: since it began.
    """

    what: str
    share: float
    seconds: float

    @property
    def left(self) -> float | None:
        """Seconds that it takes from now on, at the speed so far; none before there is one."""
        return self.seconds * (1.0 / self.share - 1.0) if self.share > 0.0 else None


def tell_in(folder: Path) -> None:
    """Write the progress of this process and its children to a folder."""
    os.environ[VARIABLE] = str((folder / NAME).resolve())


def teller(what: str) -> Callable[[float, str], None]:
    """Return what writes the progress of something that begins now; without ``tell_in`` it does nothing.

    Write errors (a full device) are ignored.
    """
    begin, last = time.time(), [0.0]
    place = os.environ.get(VARIABLE)

    def tell(share: float, text: str) -> None:
        now = time.time()
        if place is None or (now - last[0] < INTERVAL and share > 0.0):
            return
        last[0] = now
        partial = Path(f"{place}.partial")
        with suppress(OSError):
            partial.write_text(json.dumps({"what": text or what, "share": share, "begin": begin}), encoding="utf-8")
            partial.replace(place)

    tell(0.0, "")
    return tell


def read_progress(folder: Path) -> Progress | None:
    """Return how far the stage is that works in a folder; none where it has not said."""
    try:
        found = json.loads((folder / NAME).read_text(encoding="utf-8"))
        return Progress(str(found["what"]), float(found["share"]), max(time.time() - float(found["begin"]), 0.0))
    except (OSError, ValueError, KeyError, TypeError):
        return None
