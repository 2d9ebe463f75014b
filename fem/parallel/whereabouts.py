"""What this process is doing: marks at the few places where it waits for others, read by the watchdog and by errors.

A mark costs some tens of nanoseconds: no clock, no lock, no text is made.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from mpi4py import MPI


@dataclass(slots=True)
class Whereabouts:
    """What a process is doing.

    Attributes:
        world: All ranks of the run, whose numbers are written.
        models: The models that it carries.
        window: The window that it is in, -1 before the first.
        waiting: What it waits for and from whom; empty while it does not.
        waits: How many waits there were.
        slow: What it does that may take any time while others wait; empty while it does no such thing.
        checkpoint: The latest checkpoint; empty without one.
        tell: Lets the other ranks know of it at once.
    """

    world: MPI.Comm | None = None
    models: str = ""
    window: int = -1
    waiting: str = ""
    waits: int = 0
    slow: str = "sets up"
    checkpoint: str = ""
    tell: Callable[[], None] | None = None

    def begin(self, world: MPI.Comm) -> None:
        """Begin a run."""
        self.world, self.models, self.window, self.waiting = world, "", -1, ""
        self.slow, self.checkpoint = "sets up", ""

    def carry(self, models: Iterable[str]) -> None:
        """Carry some models from here on."""
        self.models = ", ".join(models)
        if self.tell is not None:
            self.tell()

    def wait_for(self, what: str) -> None:
        """Begin to wait."""
        self.waits += 1
        self.waiting = what

    def go_on(self) -> None:
        """Have got what was waited for."""
        self.waiting = ""

    @contextmanager
    def busy(self, with_what: str) -> Iterator[None]:
        """Do something that may take any time."""
        before, self.slow = self.slow, with_what
        yield
        self.slow = before

    def names(self, comm: MPI.Comm, ranks: Iterable[int]) -> str:
        """Return in words who some ranks of a communicator are in the run."""
        numbers = list(ranks)
        if self.world is not None:
            numbers = list(MPI.Group.Translate_ranks(comm.group, numbers, self.world.group))
        return f"rank{'s' if len(numbers) > 1 else ''} {', '.join(str(number) for number in numbers)}"

    @property
    def last_checkpoint(self) -> str:
        """Return in words where a run could continue from, to be added to an error; empty before the first window."""
        if self.checkpoint:
            return f"; last checkpoint: {self.checkpoint}"
        return "; there is no checkpoint yet" if self.window >= 0 else ""


HERE = Whereabouts()
