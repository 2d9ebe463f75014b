"""Collective error handling: an error on one rank is raised on all ranks, so that no rank waits for it."""

from collections.abc import Callable
from typing import TypeVar

from mpi4py import MPI

from reflowshock.fem.errors import AgreedError
from reflowshock.fem.parallel.waiting import wait_for_all

Result = TypeVar("Result")


def agreed(comm: MPI.Comm, work: Callable[[], Result]) -> Result:
    """Run a function on each rank, and raise on all ranks if it fails on any; collective.

    Args:
        comm: Communicator of the ranks that agree.
        work: Function without arguments.

    Returns:
        Result of ``work`` on this rank.

    Raises:
        AgreedError: The function failed on some ranks; on every rank, with their messages.
    """
    result, error, failure = None, None, None
    try:
        result = work()
    except Exception as caught:  # any error must reach the other ranks; it is raised again below
        error = caught
        failure = f"{type(caught).__name__}: {caught}"
    wait_for_all(comm)
    failures = dict.fromkeys(message for message in comm.allgather(failure) if message)
    if failures:
        raise AgreedError("; ".join(failures)) from error
    return result  # type: ignore[return-value]  # without a failure every rank has its result
