"""What the ranks of a run do, shared through a file: one line of fixed length for each of them."""

import json
import os
import socket
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

LINE = 512  # bytes; longer texts are cut
ERROR = "error.txt"  # in the folder of a run: why it ended, as on standard error


@dataclass(frozen=True, slots=True)
class Status:
    """What one rank did when it was heard of last.

    Attributes:
        rank: Its number.
        process: Its process id, on ``host``.
        seen: When it was heard of [s].
        models: The models that it carries.
        window: The window that it is in, -1 before the first.
        waiting: What it waits for, and ``waited`` how long by now [s].
        slow: What it does that may take any time.
    """

    rank: int
    process: int
    host: str
    seen: float
    models: str
    window: int
    waiting: str
    waited: float
    slow: str

    @property
    def name(self) -> str:
        """Return in words who it is."""
        return f"rank {self.rank}{f' ({self.models})' if self.models else ''}"

    @property
    def place(self) -> str:
        """Return in words where in the run it is."""
        return f"in window {self.window}" if self.window >= 0 else "before the first window"

    @property
    def has_died(self) -> bool:
        """Return whether its process is gone; False where that cannot be known, as on another machine."""
        return self._state in ("gone", "Z", "X")  # the last two: it has ended, its parent has not looked yet

    @property
    def is_stopped(self) -> bool:
        """Return whether its process is stopped (SIGSTOP); False where that cannot be known, as on another machine."""
        return self._state == "T"

    @property
    def _state(self) -> str:
        """Return the letter by which the system says what the process does; nothing where that cannot be known."""
        if self.host != socket.gethostname():
            return ""
        try:
            stat = Path(f"/proc/{self.process}/stat").read_text(encoding="utf-8", errors="replace")
        except FileNotFoundError:
            return "gone"
        return stat.rpartition(")")[2].split()[0]

    def describe(self, silence: float) -> str:
        """Return in words what it does; a rank not heard of for ``silence`` seconds may be stopped."""
        silent = time.time() - self.seen
        if silent > silence:
            return f"{self.name}: no sign of life for {silent:.0f} s; last seen {self.place}, it {self._doing}"
        return f"{self.name}: {self.place} it {self._doing}"

    @property
    def _doing(self) -> str:
        if self.waiting:
            return f"has waited {self.waited:.0f} s for {self.waiting}"
        return self.slow or "computes"


class StatusBoard:
    """The file; ranks need a file system that all of them see."""

    def __init__(self, path: Path) -> None:
        """Open the file, whoever comes first makes it."""
        self.path = path
        self._claimed = path.with_name(path.name + ".claimed")
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)

    def write(self, status: Status) -> None:
        """Say what a rank does."""
        text = json.dumps(asdict(status)).encode()
        if len(text) >= LINE:
            text = json.dumps(asdict(status) | {"waiting": status.waiting[:40], "models": "", "slow": ""}).encode()
        os.pwrite(self._file, text.ljust(LINE - 1) + b"\n", status.rank * LINE)

    def read(self) -> list[Status]:
        """Return what all ranks said last."""
        lines = os.pread(self._file, os.fstat(self._file).st_size, 0).decode(errors="replace").splitlines()
        found = []
        for line in lines:
            with suppress(ValueError, TypeError):  # of a rank that has said nothing yet, or is just writing
                found.append(Status(**json.loads(line)))
        return found

    def claim(self) -> bool:
        """Return whether this rank is the first to report the end of the run."""
        try:
            os.close(os.open(self._claimed, os.O_CREAT | os.O_EXCL, 0o600))
        except FileExistsError:
            return False
        return True

    def close(self, remove: bool) -> None:
        """Close the file, and remove it for all."""
        os.close(self._file)
        if remove:
            for path in (self.path, self._claimed):
                path.unlink(missing_ok=True)
