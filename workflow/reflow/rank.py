"""One MPI rank: runs jobs from a folder until none is left or one fails; see ``ranks.py``.

Jobs and results are data files. The function that runs them is named on the command line, never in a file.
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
PAUSE = 0.2  # seconds between two lines of progress


@dataclass(frozen=True, slots=True)
class JobResult:
    """Result of a job: a value, or the message of its error."""

    value: Any = None
    error: str = ""


class ProgressReporter:
    """Reporter of a joint's progress to the launcher, one line at a time and rate-limited."""

    def __init__(self, name: str) -> None:
        """Start with the next report.

        Args:
            name: Name of the joint.
        """
        self._name, self._last = name, 0.0

    def __call__(self, fraction: float) -> None:
        """Print the fraction done, unless the last line is recent and the job is unfinished."""
        if fraction >= 1.0 or monotonic() - self._last >= PAUSE:
            self._last = monotonic()
            sys.stdout.write(json.dumps({self._name: fraction}) + "\n")
            sys.stdout.flush()


def name_of(work: Callable) -> str:
    """Return the name "module:function" of a module-level function, by which another process can import it.

    Args:
        work: The function.
    """
    return f"{work.__module__}:{work.__qualname__}"


def function_of(name: str) -> Callable:
    """Import and return the module-level function with a name "module:function", as from ``name_of``."""
    module, _, function = name.partition(":")
    imported: Callable = getattr(import_module(module), function)
    return imported


def records_of(work: Callable) -> tuple[type, ...]:
    """Return the types that may occur in the files of jobs and results of a function.

    Args:
        work: Function that runs jobs; its module lists the types by a function ``records``.

    Returns:
        ``JobResult`` and the types of the module; only these are created when a file is read.
    """
    return (JobResult, *sys.modules[work.__module__].records())


def claim(path: Path) -> bool:
    """Claim a job by creating a file next to it; return False if another rank has claimed it.

    Args:
        path: File of the job.
    """
    try:
        path.with_suffix(TAKEN).touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def run_job(path: Path, work: Callable) -> JobResult:
    """Run the job in a file; errors are returned, not raised.

    Args:
        path: File with the job, which is read.
        work: Module-level function of the job and of a reporter of the fraction done, which returns the result.

    Returns:
        Value of the function, or the message of its error.
    """
    try:
        return JobResult(work(read_data(path, records_of(work)), ProgressReporter(path.stem)))
    except Exception as error:  # the launcher reports any error
        return JobResult(error=f"{type(error).__name__}: {error}")


def main(folder: Path, work: Callable) -> int:
    """Run jobs of a folder on this rank until none is left or one fails; other ranks run the same loop.

    Args:
        folder: Folder of the job files ``*.job``; result files ``*.result`` are written next to them.
        work: Module-level function of the job and of a reporter of the fraction done, which returns the result.

    Returns:
        Exit code of the process: 1 if a job failed, else 0.
    """
    for path in filter(claim, sorted(folder.glob(f"*{JOB}"))):
        result = run_job(path, work)
        write_data(path.with_suffix(RESULT), {}, result)
        if result.error:
            return 1
        ProgressReporter(path.stem)(1.0)
    return 0
