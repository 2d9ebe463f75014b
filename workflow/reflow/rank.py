"""What one MPI rank does: it takes jobs from a folder, until none is left or one fails; see `ranks.py`."""

import json
import pickle
import sys
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

JOB, TAKEN, RESULT = ".job", ".taken", ".result"
PAUSE = 0.2  # seconds between two words of the progress


@dataclass(frozen=True, slots=True)
class Done:
    """What a job gave: a value, or in words why there is none."""

    value: Any = None
    error: str = ""


class Voice:
    """Tells the launcher how far a joint is, a line at a time and not too often."""

    def __init__(self, name: str) -> None:
        """Begin with the next word."""
        self._name, self._last = name, 0.0

    def __call__(self, fraction: float) -> None:
        """Tell it, if there was a pause or this is the end."""
        if fraction >= 1.0 or monotonic() - self._last >= PAUSE:
            self._last = monotonic()
            sys.stdout.write(json.dumps({self._name: fraction}) + "\n")
            sys.stdout.flush()


def take(path: Path) -> bool:
    """Take a job, unless another rank has."""
    try:
        path.with_suffix(TAKEN).touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def done(path: Path) -> Done:
    """Do a job."""
    work, job = pickle.loads(path.read_bytes())
    try:
        return Done(work(job, Voice(path.stem)))
    except Exception as error:  # whatever it is, the launcher must hear of it
        return Done(error=f"{type(error).__name__}: {error}")


def leave(path: Path, result: Done) -> None:
    """Write what a job gave, at once or not at all."""
    partial = path.with_suffix(".partial")
    partial.write_bytes(pickle.dumps(result))
    partial.replace(path.with_suffix(RESULT))


def main(folder: Path) -> int:
    """Do jobs until none is left or one fails; return the exit code."""
    for path in filter(take, sorted(folder.glob(f"*{JOB}"))):
        result = done(path)
        leave(path, result)
        if result.error:
            return 1
        Voice(path.stem)(1.0)
    return 0
