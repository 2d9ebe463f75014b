"""Number of MPI ranks of a run that leaves it to the program: as many as there are idle cores.

Ranks wait for each other after each time step. Where one of them shares its core with another program, all are slower
than a single rank would be.
"""

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from reflowshock.workflow.process.launch import LAUNCHER

STAT = Path("/proc/stat")
PROBE = 0.25  # [s], 25 ticks of the system's clock
NEARLY_IDLE = 0.5  # share of a core that a rank needs at least


@dataclass(frozen=True, slots=True)
class RankCount:
    """Number of MPI ranks, and the reason for it.

    Attributes:
        ranks: Number of ranks.
        why: Reason in words; empty if the case or a cluster job gives the number.
    """

    ranks: int
    why: str = ""

    def __str__(self) -> str:
        reason = f" ({self.why})" if self.why else ""
        return f"{self.ranks} {'rank' if self.ranks == 1 else 'ranks'}{reason}"


def decide_ranks(least: int, most: int, cores: int) -> RankCount:
    """Return the number of MPI ranks for a run, as many as cores are idle; measuring them takes ``PROBE`` (0.25 s).

    Nothing is measured, and the result is ``most``, if both limits are equal or in a job of a cluster; with at most
    ``least`` cores it is ``least``.

    Args:
        least: Smallest number that the case allows.
        most: Largest number that the case allows; equal to ``least`` if the case gives the number.
        cores: Number of cores that the run may use.
    """
    if least == most or LAUNCHER in os.environ:  # a cluster job has cores of its own for all ranks
        return RankCount(most)
    if cores <= least:
        return RankCount(least, f"{cores} {'core' if cores == 1 else 'cores'} for this run")
    idle = idle_cores()
    return RankCount(max(least, min(most, cores, int(idle + NEARLY_IDLE))), f"{idle:.1f} cores idle")


def idle_cores(seconds: float = PROBE) -> float:
    """Return how many of the cores that this process may use are idle, as a mean over the measured time.

    Args:
        seconds: Time of the measurement, during which the function sleeps [s].
    """
    allowed, before = os.sched_getaffinity(0), core_times()
    time.sleep(seconds)
    return idle_between(before, core_times(), allowed)


def idle_between(before: Mapping[int, tuple[int, int]], after: Mapping[int, tuple[int, int]], cores: set[int]) -> float:
    """Return the mean number of idle cores between two readings of ``core_times``; unknown cores count as idle.

    Args:
        before: Earlier reading: number of a core -> idle time and total time [ticks].
        after: Later reading in the same form.
        cores: Numbers of the cores to count.
    """
    idle = 0.0
    for core in cores:
        if core not in before or core not in after or after[core][1] == before[core][1]:
            idle += 1.0
        else:
            idle += (after[core][0] - before[core][0]) / (after[core][1] - before[core][1])
    return idle


def core_times() -> dict[int, tuple[int, int]]:
    """Return the times of each core since the system started.

    Returns:
        Number of the core -> idle time (with waits for disks) and total time [ticks]; empty without ``/proc/stat``.
    """
    try:
        lines = STAT.read_text(encoding="ascii").splitlines()
    except OSError:
        return {}
    rows = (line.split() for line in lines if line.startswith("cpu") and line[3:4].isdigit())
    return {int(row[0][3:]): (int(row[4]) + int(row[5]), sum(map(int, row[1:9]))) for row in rows}
