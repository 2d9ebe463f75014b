"""One MPI rank: takes jobs from a folder until none is left or one fails; see `ranks.py`.

Jobs and results are data files. The command line names the function that runs them; no file does.
"""

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from time import monotonic
from typing import Any

from reflowshock.data_file import read_data, write_data

JOB, TAKEN, RESULT = ".job", ".taken", ".result"
PAUSE = 0.2  # seconds between two words of the progress


@dataclass(frozen=True, slots=True)
class Done:
    """Result of a job: a value, or the message of its error."""

    value: Any = None
    error: str = ""


class Voice:
    """Reporter of a joint's progress to the launcher, one line at a time and rate-limited."""

    def __init__(self, name: str) -> None:
        """Begin with the next word."""
        self._name, self._last = name, 0.0

    def __call__(self, fraction: float) -> None:
        """Tell it, if there was a pause or this is the end."""
        if fraction >= 1.0 or monotonic() - self._last >= PAUSE:
            self._last = monotonic()
            sys.stdout.write(json.dumps({self._name: fraction}) + "\n")
            sys.stdout.flush()


def name_of(work: Callable) -> str:
    """Return the name by which another process finds a function of a module."""
    return f"{work.__module__}:{work.__qualname__}"


def find(name: str) -> Callable:
    """Return the function of which `name_of` has given the name."""
    module, _, function = name.partition(":")
    found: Callable = getattr(import_module(module), function)
    return found


def records_of(work: Callable) -> tuple[type, ...]:
    """Return the records that may be in the files of jobs and results: its module lists them."""
    return (Done, *sys.modules[work.__module__].records())


def take(path: Path) -> bool:
    """Take a job, unless another rank has."""
    try:
        path.with_suffix(TAKEN).touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def done(path: Path, work: Callable) -> Done:
    """Do a job."""
    try:
        return Done(work(read_data(path, records_of(work)), Voice(path.stem)))
    except Exception as error:  # whatever it is, the launcher must hear of it
        return Done(error=f"{type(error).__name__}: {error}")


def main(folder: Path, work: Callable) -> int:
    """Do jobs until none is left or one fails; return the exit code."""
    for path in filter(take, sorted(folder.glob(f"*{JOB}"))):
        result = done(path, work)
        write_data(path.with_suffix(RESULT), {}, result)
        if result.error:
            return 1
        Voice(path.stem)(1.0)
    return 0
