"""Status of all ranks of a run in a shared file, with one line of fixed length for each rank."""

import json
import os
import socket
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

LINE = 512  # bytes; longer texts are cut
ERROR = "error.txt"  # copy of the final error message in the folder of a run


@dataclass(frozen=True, slots=True)
class Status:
    """Last known status of one rank.

    Attributes:
        rank: Number of the rank.
        process: Process id on ``host``.
        host: Name of the machine.
        seen: Time of the status, in seconds since the epoch.
        models: Models that the rank carries.
        window: Current window, -1 before the first.
        waiting: Description of the message or rank that it waits for; empty if it does not wait.
        waited: Duration of the wait so far [s].
        slow: Description of an operation of unlimited duration; empty if there is none.
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
        """Rank number and models as text."""
        return f"rank {self.rank}{f' ({self.models})' if self.models else ''}"

    @property
    def position(self) -> str:
        """Current window as text."""
        return f"in window {self.window}" if self.window >= 0 else "before the first window"

    @property
    def has_died(self) -> bool:
        """Whether the process has ended; False for processes on another machine."""
        return self._state in ("gone", "Z", "X")  # Z and X: ended, but not yet reaped by its parent

    @property
    def is_stopped(self) -> bool:
        """Whether the process is stopped (SIGSTOP); False for processes on another machine."""
        return self._state == "T"

    @property
    def _state(self) -> str:
        """Process state letter of the operating system, ``gone``, or empty for another machine."""
        if self.host != socket.gethostname():
            return ""
        try:
            stat = Path(f"/proc/{self.process}/stat").read_text(encoding="utf-8", errors="replace")
        except FileNotFoundError:
            return "gone"
        return stat.rpartition(")")[2].split()[0]

    def describe(self, silence: float) -> str:
        """Return the activity of the rank as text, or its silence if that exceeds ``silence`` [s]."""
        silent = time.time() - self.seen
        if silent > silence:
            return f"{self.name}: no status for {silent:.0f} s; last seen {self.position}, it {self._doing}"
        return f"{self.name}: {self.position} it {self._doing}"

    @property
    def _doing(self) -> str:
        if self.waiting:
            return f"has waited {self.waited:.0f} s for {self.waiting}"
        return self.slow or "computes"


class StatusBoard:
    """Shared status file; all ranks need access to its file system."""

    def __init__(self, path: Path) -> None:
        """Open the file; the first rank creates it."""
        self.path = path
        self._claimed = path.with_name(path.name + ".claimed")
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)

    def write(self, status: Status) -> None:
        """Write the status of a rank."""
        text = json.dumps(asdict(status)).encode()
        if len(text) >= LINE:
            text = json.dumps(asdict(status) | {"waiting": status.waiting[:40], "models": "", "slow": ""}).encode()
        os.pwrite(self._file, text.ljust(LINE - 1) + b"\n", status.rank * LINE)

    def read(self) -> list[Status]:
        """Return the last status of all ranks."""
        lines = os.pread(self._file, os.fstat(self._file).st_size, 0).decode(errors="replace").splitlines()
        statuses = []
        for line in lines:
            with suppress(ValueError, TypeError):  # the rank has no status yet, or is writing it
                statuses.append(Status(**json.loads(line)))
        return statuses

    def claim(self) -> bool:
        """Return whether this rank is the first to report the end of the run."""
        try:
            os.close(os.open(self._claimed, os.O_CREAT | os.O_EXCL, 0o600))
        except FileExistsError:
            return False
        return True

    def close(self, remove: bool) -> None:
        """Close the file, and optionally remove it for all ranks."""
        os.close(self._file)
        if remove:
            for path in (self.path, self._claimed):
                path.unlink(missing_ok=True)
