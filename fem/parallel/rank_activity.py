"""Current activity of this process, recorded where it waits for other ranks, for the watchdog and error messages.

A record costs some tens of nanoseconds, without a clock, a lock or text formatting.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from mpi4py import MPI


@dataclass(slots=True)
class RankActivity:
    """Current activity of a process.

    Attributes:
        world: Communicator of all ranks of the run, whose numbers appear in messages.
        models: Models that the process carries.
        window: Current window, -1 before the first.
        waiting: Description of the message and ranks that it waits for; empty if it does not wait.
        waits: Number of waits so far.
        slow: Description of an operation of unlimited duration for which others wait; empty if there is none.
        checkpoint: Latest checkpoint as text; empty without one.
        publish: Function that shows the activity to the other ranks, or None.
    """

    world: MPI.Comm | None = None
    models: str = ""
    window: int = -1
    waiting: str = ""
    waits: int = 0
    slow: str = "sets up"
    checkpoint: str = ""
    publish: Callable[[], None] | None = None

    def begin(self, world: MPI.Comm) -> None:
        """Reset the activity at the start of a run."""
        self.world, self.models, self.window, self.waiting = world, "", -1, ""
        self.slow, self.checkpoint = "sets up", ""

    def carry(self, models: Iterable[str]) -> None:
        """Record the models that the process carries from now on."""
        self.models = ", ".join(models)
        if self.publish is not None:
            self.publish()

    def wait_for(self, description: str) -> None:
        """Record the start of a wait."""
        self.waits += 1
        self.waiting = description

    def go_on(self) -> None:
        """Record the end of a wait."""
        self.waiting = ""

    @contextmanager
    def busy(self, description: str) -> Iterator[None]:
        """Record an operation of unlimited duration inside a ``with`` block."""
        previous, self.slow = self.slow, description
        yield
        self.slow = previous

    def names(self, comm: MPI.Comm, ranks: Iterable[int]) -> str:
        """Return the numbers in the run of some ranks of a communicator, as text."""
        numbers = list(ranks)
        if self.world is not None:
            numbers = list(MPI.Group.Translate_ranks(comm.group, numbers, self.world.group))
        return f"rank{'s' if len(numbers) > 1 else ''} {', '.join(str(number) for number in numbers)}"

    @property
    def last_checkpoint(self) -> str:
        """Suffix of an error message with the latest checkpoint; empty before the first window."""
        if self.checkpoint:
            return f"; last checkpoint: {self.checkpoint}"
        return "; there is no checkpoint yet" if self.window >= 0 else ""


ACTIVITY = RankActivity()
