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
    """Wait until all messages of this rank have arrived; the core is left to other processes meanwhile.

    Persistent requests can then be started again. The function has no time limit.

    Args:
        requests: Started MPI requests of this rank, completed on return; if empty, returns at once.
    """
    begin = time.perf_counter()
    while not MPI.Request.Testall(requests):
        pause(time.perf_counter() - begin)


def pause(waited: float) -> None:
    """Pause between two tests of a wait: not at all at first, then for other processes of the core, then asleep.

    The core is yielded from 0.1 ms of waiting on; from 0.2 ms on the process sleeps 5 % of the time waited, 0.05 to 2
    ms.

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
