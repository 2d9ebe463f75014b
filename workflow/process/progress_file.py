"""Progress of a stage in a file, which ``status`` reads in a second terminal."""

import json
import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

NAME = "progress.json"
INTERVAL = 1.0  # interval between two writes [s]
VARIABLE = "REFLOWSHOCK_PROGRESS"  # path of the file, inherited by the processes of a stage


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a stage.

    Attributes:
        what: Current activity.
        share: Completed share, 0 to 1.
        seconds: Time since the start of the activity [s].
    """

    what: str
    share: float
    seconds: float

    @property
    def left(self) -> float | None:
        """Predicted remaining time [s] at the average speed; None at share 0."""
        return self.seconds * (1.0 / self.share - 1.0) if self.share > 0.0 else None


def write_progress_to(folder: Path) -> None:
    """Make this process and its children write their progress to ``progress.json`` in a folder, from now on."""
    os.environ[VARIABLE] = str((folder / NAME).resolve())


def progress_writer(what: str) -> Callable[[float, str], None]:
    """Return a function that writes the progress of an activity starting now.

    It does nothing before ``write_progress_to`` has set a folder, and ignores write errors (a full device).

    Args:
        what: Name of the activity.

    Returns:
        Function of the completed share, 0 to 1, and a text that replaces the name unless it is empty.
    """
    start, last = time.time(), [0.0]
    path = os.environ.get(VARIABLE)

    def write(share: float, text: str) -> None:
        now = time.time()
        if path is None or (now - last[0] < INTERVAL and share > 0.0):
            return
        last[0] = now
        partial = Path(f"{path}.partial")
        with suppress(OSError):
            partial.write_text(json.dumps({"what": text or what, "share": share, "begin": start}), encoding="utf-8")
            partial.replace(path)

    write(0.0, "")
    return write


def read_progress(folder: Path) -> Progress | None:
    """Return the progress of the stage that runs in a folder, or None if it has not written any.

    Args:
        folder: Folder that was given to ``write_progress_to``.

    Returns:
        Name of the current activity, completed share (0 to 1), and time since its start [s].
    """
    try:
        content = json.loads((folder / NAME).read_text(encoding="utf-8"))
        return Progress(str(content["what"]), float(content["share"]), max(time.time() - float(content["begin"]), 0.0))
    except (OSError, ValueError, KeyError, TypeError):
        return None
