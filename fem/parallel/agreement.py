"""Errors across ranks: a rank that fails tells the others, so that none waits for it."""

from collections.abc import Callable
from typing import TypeVar

from mpi4py import MPI

from reflowshock.fem.errors import AgreedError

Result = TypeVar("Result")


def agreed(comm: MPI.Comm, work: Callable[[], Result]) -> Result:
    """Do work that is local to each rank; fail on all ranks if it fails on one. Collective.

    Raises:
        AgreedError: On every rank, with the messages of the ranks that failed.
    """
    result, error, failure = None, None, None
    try:
        result = work()
    except Exception as caught:  # whatever it is, the other ranks must hear of it; it is raised again below
        error = caught
        failure = f"{type(caught).__name__}: {caught}"
    failures = dict.fromkeys(message for message in comm.allgather(failure) if message)
    if failures:
        raise AgreedError("; ".join(failures)) from error
    return result  # type: ignore[return-value]  # without a failure every rank has its result
