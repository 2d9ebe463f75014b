"""Checks of a case before a run (the gate), and confirmation of long runs.

All input files are read before anything runs. Implausible values need ``--force``, more ranks than cores need
``--oversubscribe``, and runs predicted to take more than an hour need ``--yes`` in scripts. Cases that do not fit into
memory are rejected.
"""

import resource
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.plausible import FORCE, find_implausible, implausible_tables
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.text import duration
from reflowshock.workflow.case.toml_file import fault_of
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.pipeline.resources import stage_resources
from reflowshock.workflow.process.environment import available_cores

LONG = 3600.0  # predicted wall time above which the user must confirm a run [s]
LARGEST_FILE = 100_000_000  # limit on input files [B]
LARGEST_MEMORY = 1e15  # limit on the memory of a case on any machine [B]
CGROUPS = Path("/sys/fs/cgroup")
UNITS = ((1e15, "PB"), (1e12, "TB"), (1e9, "GB"), (1e6, "MB"))


@dataclass(frozen=True, slots=True)
class Leave:
    """Exceptions granted by the user: cases larger than this machine, implausible values."""

    oversubscribe: bool = False
    force: bool = False


def problems_of(case: Case, leave: Leave) -> list[Problem]:
    """Return the problems of a case whose individual values are valid; the cheapest checks run first.

    Args:
        case: Case with values that are valid one by one.
        leave: Permissions of the user: more ranks than cores, implausible values.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    with np.errstate(all="ignore"):
        try:
            return _values(case, leave) or kind_of(case).problems(case) or list(too_large(case, leave))
        except CaseError as error:
            return error.problems
        except (ArithmeticError, ValueError, MemoryError) as error:  # outside the range of floats
            return [Problem("", f"has values outside the range of the computation: {error or type(error).__name__}")]


def _values(case: Case, leave: Leave) -> list[Problem]:
    """Return problems with the number of ranks, implausible values and tables, and unreadable files."""
    problems = [] if leave.oversubscribe else list(too_many_ranks(case))
    problems += [] if leave.force else list(find_implausible(case))
    problems += unreadable_files(case)
    return problems if problems or leave.force else list(implausible_tables(case))


def unreadable_files(case: Case) -> Iterator[Problem]:
    """Yield a problem for each input file of a case that is missing, unreadable or too large.

    Args:
        case: Case with the paths of its files.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    for key, path in case.files.items():
        fault = fault_of(path, LARGEST_FILE)
        if fault:
            yield Problem(key, fault, str(path))


def too_many_ranks(case: Case) -> Iterator[Problem]:
    """Yield a problem for each key that requests more MPI ranks than this machine has cores.

    Args:
        case: Case with its numbers of ranks.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    cores = available_cores()
    for key, ranks in case.ranks_by_key.items():
        if ranks > cores:
            message = f"asks for {ranks} MPI ranks, but this machine has {cores} cores"
            yield Problem(key, message, ranks, f"<= {cores} in total, or more with --oversubscribe")


def too_large(case: Case, leave: Leave | None = None) -> Iterator[Problem]:
    """Yield a problem if the predicted memory of a case exceeds the memory of this machine.

    Args:
        case: Case to check.
        leave: Permissions of the user: implausible values (``force``) skip the check; more ranks than cores
            (``oversubscribe``, for runs elsewhere) allow any memory that a machine can have. None grants neither.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    needed, leave = needed_memory(case), leave or Leave()
    if leave.force:
        return
    allowed = f"larger particles or elements, fewer MPI ranks, or {FORCE}"
    if not needed <= LARGEST_MEMORY:
        yield Problem("", f"needs about {bytes_text(needed)} of memory, more than any machine has", None, allowed)
    elif not leave.oversubscribe and needed > machine_memory():
        message = f"needs about {bytes_text(needed)} of memory, but this machine has {bytes_text(machine_memory())}"
        yield Problem("", message, None, allowed)


def needed_memory(case: Case) -> float:
    """Predict the memory [B] of the largest stage of a case on this machine."""
    stages = stage_resources(case, cores=available_cores()).values()
    return 1e6 * max((stage.mem_mb for stage in stages), default=0)


def machine_memory() -> float:
    """Return the memory available to a new process [B]: minimum of free memory, control groups and ulimit -v."""
    limits = [*_free_memory(), *_group_memory()]
    soft = resource.getrlimit(resource.RLIMIT_AS)[0]
    if soft != resource.RLIM_INFINITY:
        limits.append(float(soft))
    return min(limits, default=float("inf"))


def ask_if_long(name: str, seconds: float, yes: bool, console: Console) -> bool:
    """Ask the user to confirm a run that is predicted to take more than an hour; shorter ones may start at once.

    Args:
        name: Name of the run.
        seconds: Predicted wall time [s].
        yes: Whether the user has already agreed.
        console: Console for the question.

    Returns:
        Whether the run may start.

    Raises:
        CaseError: The console is not interactive.
    """
    if yes or seconds <= LONG:
        return True
    prediction = f"{name} is predicted to take about {duration(seconds)}"
    if not (console.is_terminal and sys.stdin is not None and sys.stdin.isatty()):
        raise CaseError("run", [Problem("", f"{prediction}; start it with --yes")])
    return console.input(f"{prediction}; run it? \\[y/N] ").strip().lower() in ("y", "yes")


def bytes_text(number: float) -> str:
    """Format a number of bytes with two digits."""
    size, unit = next(((size, unit) for size, unit in UNITS if number >= size), UNITS[-1])
    figure = number / size
    return f"{figure:.2g} {unit}" if figure < 100.0 or figure >= 1e6 else f"{figure:.0f} {unit}"


def _free_memory() -> Iterator[float]:
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return
    for line in lines:
        if line.startswith("MemAvailable:"):
            yield 1024.0 * float(line.split()[1])


def _group_memory() -> Iterator[float]:
    """Yield the memory left in each enclosing control group of this process (versions 2 and 1) [B]."""
    try:
        groups = [line.split(":", 2) for line in Path("/proc/self/cgroup").read_text().splitlines()]
    except OSError:
        return
    for _, controllers, name in groups:
        if controllers in ("", "memory"):
            folder = CGROUPS / controllers
            yield from _left(folder)
            for part in Path(name.lstrip("/")).parts:
                folder /= part
                yield from _left(folder)


def _left(folder: Path) -> Iterator[float]:
    """Yield the memory left in a control group, where cached files do not count as used [B]."""
    for limit, used, cached in (
        ("memory.max", "memory.current", "inactive_file"),
        ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    ):
        try:
            most, taken = float((folder / limit).read_text()), float((folder / used).read_text())
            stat = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
            yield max(0.0, most - taken + float(stat.get(cached, 0.0)))
        except (OSError, ValueError):  # no limit, or "max"
            continue
