"""Interface of the pools that reflow several joints at a time: processes of this machine, or MPI ranks."""

from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Protocol, Self, TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")
Report = Callable[[float], None]
Shares = Mapping[str, float]


class ReflowError(RuntimeError):
    """Error for a joint whose reflow failed; the message names the joint."""


class JointPool(Protocol):
    """Pool of processes or ranks; leaving its context ends all of them."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None: ...

    def run(
        self, work: Callable[[Job, Report], Result], jobs: Mapping[str, Job], progress: Callable[[Shares], None]
    ) -> dict[str, Result]:
        """Run the work of each joint.

        Args:
            work: Function of a module. It takes a job and a function that reports the fraction done, and returns the
                result. Jobs and results may contain data and the types that the module's function ``records`` lists.
            jobs: Job by joint name.
            progress: Function that is called with the fraction done by joint name.

        Returns:
            Result by joint name, in the order of the jobs.

        Raises:
            ReflowError: A joint failed; the message gives its name and error.
        """
