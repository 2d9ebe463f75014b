"""Launch of MPI programs: command line, lines of output, and an orderly end, also of stopped processes."""

import os
import shlex
import shutil
import signal
import subprocess
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from reflowshock.fem.parallel.mpi_environment import without_mpi_job
from reflowshock.fem.parallel.status_board import ERROR
from reflowshock.workflow.process.error_exit import describe_text

PATIENCE = 60.0  # how long a process may be stopped [s]
TICK = 1.0  # interval between two checks [s]
STOPPED = "T"
RANK = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", "SLURM_PROCID")  # variables with the number of an MPI rank
PROC = Path("/proc")


class StoppedProcesses:
    """Watchdog that kills a process and its descendants if they stay stopped (SIGSTOP) while its block runs.

    Attributes:
        message: Message with the killed processes; empty before that.
    """

    def __init__(self, process: int, patience: float = PATIENCE) -> None:
        """Store the process id and the time that a process may be stopped [s]."""
        self.message = ""
        self._process, self._patience = process, patience
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> "StoppedProcesses":
        self._thread.start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """End the watchdog thread."""
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        """Check periodically; count checks, not seconds, since this process may be stopped, too."""
        checks: dict[int, int] = {}
        tick = min(TICK, self._patience / 4)
        while not self._over.wait(tick):
            checks = {process: checks.get(process, 0) + 1 for process in find_stopped(self._process)}
            late = [process for process, count in checks.items() if count * tick > self._patience]
            if late:
                names = " and ".join(name(process) for process in late)
                self.message = f"{names} had been stopped (SIGSTOP) for {self._patience:g} s, so the run was ended"
                for process in late:
                    with suppress(OSError):
                        os.kill(process, signal.SIGKILL)


def find_stopped(root: int) -> list[int]:
    """Return the process ids of those that are stopped (by a signal), among a process and its descendants.

    Args:
        root: Process id.
    """
    parents: dict[int, int] = {}
    halted = []
    for folder in PROC.iterdir():
        if not folder.name.isdigit():
            continue
        try:
            status = (folder / "stat").read_text(encoding="utf-8", errors="replace")
        except OSError:  # it has ended meanwhile
            continue
        state, parent = status.rpartition(")")[2].split()[:2]
        parents[int(folder.name)] = int(parent)
        if state == STOPPED:
            halted.append(int(folder.name))
    return [process for process in halted if _descends(process, root, parents)]


def _descends(process: int, root: int, parents: dict[int, int]) -> bool:
    while process > 1 and process != root:
        process = parents.get(process, 0)
    return process == root


def name(process: int) -> str:
    """Return the name of a process for messages, with its MPI rank if it has one.

    Args:
        process: Process id.
    """
    with suppress(OSError):
        variables = (PROC / str(process) / "environ").read_bytes().split(b"\0")
        environment = dict(os.fsdecode(variable).partition("=")[::2] for variable in variables)
        number = next((environment[key] for key in RANK if key in environment), None)
        if number is not None:
            return f"rank {number} (process {process})"
    return f"process {process}"


GRACE = 5.0  # time for a program to end after SIGTERM [s]
TRACEBACK = "Traceback (most recent call last):"
ERROR_PREFIX = "error: "  # prefix of the error messages of the program
LAST_LINES = 15
LAUNCHER = "REFLOWSHOCK_MPI_LAUNCHER"  # variable with the MPI launcher, e.g. "srun --mpi=pmix" within a Slurm job
MPIRUN = "mpirun"
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}  # of a rank
# Open MPI binds the ranks of each run to the first cores, which simultaneous runs would share.
UNBOUND = ("--bind-to", "none")
QUIET = ("--mca", "orte_execute_quiet", "1")  # for Open MPI 4; Open MPI 5 ignores it

# Command prefixes: the system sends the signal when the parent process ends for any reason.
END_WITH_PARENT = ("setpriv", "--pdeathsig", "TERM")
DIE_WITH_PARENT = ("setpriv", "--pdeathsig", "KILL")
# Options of env: Open MPI would mistake a stage within a Slurm step for a rank started by srun.
OWN_STEP = "-u SLURM_STEPID -u SLURM_STEP_ID"
ENDINGS: dict[int, str] = {
    signal.SIGKILL: "was killed, probably because memory ran out",
    signal.SIGXFSZ: "was ended because a file exceeded the largest allowed size (ulimit -f)",
    signal.SIGXCPU: "was ended because it exceeded the processor time limit (ulimit -t)",
    signal.SIGSEGV: "crashed (segmentation fault)",
    signal.SIGBUS: "crashed (bus error, as when no space is left for a file in memory)",
}


class LaunchError(RuntimeError):
    """Error end of a launched program; the message contains its last output."""


def mpi_command(ranks: int, program: Sequence[str], oversubscribe: bool) -> list[str]:
    """Return the command that starts a program on MPI ranks, with Open MPI or the launcher in ``LAUNCHER``.

    Args:
        ranks: Number of MPI ranks.
        program: Program and arguments.
        oversubscribe: Whether there may be more ranks than cores.

    Returns:
        Program and arguments, for ``launch`` or ``subprocess``.
    """
    launcher = shlex.split(os.environ.get(LAUNCHER, "")) or [MPIRUN, *UNBOUND]
    if Path(launcher[0]).name != MPIRUN:
        return [*launcher, "-n", str(ranks), *program]
    command = [*launcher, *QUIET, "-n", str(ranks)]
    if os.geteuid() == 0:
        command.append("--allow-run-as-root")
    if oversubscribe:
        command.append("--oversubscribe")
    return [*command, *program]


def launch(command: Sequence[str], on_line: Callable[[str], None], log: Path, patience: float = PATIENCE) -> None:
    """Run a program to its end, reading its standard output line by line.

    Args:
        command: Program and arguments.
        on_line: Function that takes each line of standard output, as soon as it is written.
        log: File for standard error; a program may also explain its end in the file ``ERROR`` of the same folder.
        patience: How long a process may be stopped [s] before the program is ended.

    Raises:
        LaunchError: The program is missing, its exit code is not 0, or one of its processes was stopped.
    """
    program = command[0]
    if shutil.which(program) is None:
        raise LaunchError(f"{program} is not installed")
    # The output is read here, not on a terminal: always in UTF-8.
    environment = without_mpi_job(os.environ) | ONE_THREAD | {"PYTHONIOENCODING": "utf-8:backslashreplace"}
    with log.open("w", encoding="utf-8") as errors:
        process = subprocess.Popen(
            [*END_WITH_PARENT, *command],
            stdout=subprocess.PIPE,
            stderr=errors,
            encoding="utf-8",
            errors="replace",
            env=environment,
            start_new_session=True,
        )
        try:
            with StoppedProcesses(process.pid, patience) as watch:
                for line in process.stdout or ():
                    on_line(line.rstrip("\n"))
                code = process.wait()
        except BaseException:
            end_group(process)
            raise
    if code != 0:
        lines = _read(log) + _read(log.with_name(ERROR))
        words = "\n".join(lines[-LAST_LINES:]) or "it wrote no message"
        message, words = (without_traceback(text, log) for text in (error_of(lines), words))
        if watch.message:
            raise LaunchError(f"{watch.message}; {message}".removesuffix("; "))
        raise LaunchError(message or f"{program} {ending(code)}: {words}")


def _read(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8", errors="replace").strip().splitlines() if path.is_file() else []


def error_of(lines: Sequence[str]) -> str:
    """Return the message that follows the last ``ERROR_PREFIX`` in the output of a program, or an empty string.

    Args:
        lines: Lines of the output, in order.
    """
    starts = [k for k, line in enumerate(lines) if line.startswith(ERROR_PREFIX)]
    return "\n".join(lines[starts[-1] :]).removeprefix(ERROR_PREFIX) if starts else ""


def without_traceback(text: str, log: Path) -> str:
    """Replace the traceback in an error message by its last line and the path of the log.

    Args:
        text: Error message; without a traceback it is returned unchanged.
        log: Path to name.
    """
    before, traceback, after = text.partition(TRACEBACK)
    if not traceback:
        return text
    last = after.strip().splitlines()[-1]
    reason, semicolon, checkpoint = last.partition("; last checkpoint")
    return f"{before.strip()} {describe_text(reason) or reason}{semicolon}{checkpoint} (details: {log})".strip()


def ending(code: int) -> str:
    """Describe how a program ended, from its exit code: below 0 or above 128 by a signal.

    Args:
        code: Exit code as ``subprocess`` returns it.
    """
    number = -code if code < 0 else code - 128
    if number in ENDINGS:
        return ENDINGS[number]
    return f"ended with exit code {code}"


def end_group(process: subprocess.Popen) -> None:
    """End a program and its descendants: SIGTERM to its process group, and SIGKILL after ``GRACE`` (5) seconds.

    Args:
        process: Running program that leads its process group.
    """
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGTERM)
    try:
        process.wait(GRACE)
    except subprocess.TimeoutExpired:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
