"""What brings the joints of an array to rest, several at a time: processes of this machine, or MPI ranks anywhere."""

from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Protocol, Self, TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")
Report = Callable[[float], None]
Shares = Mapping[str, float]


class ReflowError(RuntimeError):
    """The reflow of a joint failed; the message names the joint."""


class JointPool(Protocol):
    """A context whose end leaves nothing running."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None: ...

    def run(
        self, work: Callable[[Job, Report], Result], jobs: Mapping[str, Job], progress: Callable[[Shares], None]
    ) -> dict[str, Result]:
        """Do a piece of work for each joint.

        Args:
            work: function of a module, called with a job and a function that takes the fraction done; jobs and results
                are data and the records that the module's function `records` lists.
            jobs: name of a joint -> job.
            progress: called with name -> fraction done.

        Returns:
            Name -> result, in the given order.

        Raises:
            ReflowError: names the first joint that failed, and how.
        """
