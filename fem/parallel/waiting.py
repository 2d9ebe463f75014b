"""Waits for other ranks that leave the core to other processes.

A wait of MPI tests its messages without a pause. It keeps a core busy and, on a busy machine, takes the core from the
very rank that it waits for. Here only the first tests follow each other, since most messages arrive within some tens of
microseconds. Then the process yields its core between two tests, and later it sleeps.
"""

import os
import time
from collections.abc import Sequence

from mpi4py import MPI

TESTING = 1e-4  # [s] a sleep takes about as long
YIELDING = 2e-4  # [s] since the start of the wait
SHORTEST_PAUSE, LONGEST_PAUSE = 5e-5, 2e-3  # [s]
PAUSE_SHARE = 0.05  # of the time waited so far, so that a pause hardly prolongs a wait


def wait_for(requests: Sequence[MPI.Request]) -> None:
    """Return when all messages have arrived; persistent requests can then be started again.

    Args:
        requests: Started requests; may be empty.
    """
    begin = time.perf_counter()
    while not MPI.Request.Testall(requests):
        pause(time.perf_counter() - begin)


def pause(waited: float) -> None:
    """Pause between two tests of a wait: not at all, for other processes of the core, or asleep.

    Args:
        waited: Time since the start of the wait [s].
    """
    if waited > YIELDING:
        time.sleep(min(max(PAUSE_SHARE * waited, SHORTEST_PAUSE), LONGEST_PAUSE))
    elif waited > TESTING:
        os.sched_yield()


def wait_for_all(comm: MPI.Comm) -> None:
    """Return when all ranks have called this function, so that a blocking call after it is short; collective.

    Args:
        comm: Communicator of the ranks.
    """
    wait_for([comm.Ibarrier()])
