"""Launching MPI programs: command line, lines of output, and a clean end whatever happens."""

import os
import signal
import subprocess
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

GRACE = 5.0  # seconds that a program has to end by itself after SIGTERM
LAST_LINES = 15


class LaunchError(RuntimeError):
    """A launched program ended with an error; the message has its last words."""


def mpi_command(ranks: int, program: Sequence[str], oversubscribe: bool) -> list[str]:
    """Return the command that starts a program on a number of MPI ranks.

    Args:
        ranks: number of MPI ranks.
        program: program and arguments.
        oversubscribe: whether there may be more ranks than cores.
    """
    command = ["mpirun", "--quiet", "-n", str(ranks)]
    if os.geteuid() == 0:
        command.append("--allow-run-as-root")
    if oversubscribe:
        command.append("--oversubscribe")
    return [*command, *program]


def launch(command: Sequence[str], on_line: Callable[[str], None], log: Path) -> None:
    """Run a program to its end, reading its standard output line by line.

    Args:
        command: program and arguments.
        on_line: called with each line of standard output.
        log: file that takes standard error.

    Raises:
        LaunchError: the program cannot be started or its exit code is not 0.
    """
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    with log.open("w") as errors:
        try:
            process = subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=errors, text=True, env=environment, start_new_session=True
            )
        except FileNotFoundError as error:
            raise LaunchError(f"{command[0]} is not installed") from error
        try:
            for line in process.stdout or ():
                on_line(line.rstrip("\n"))
            code = process.wait()
        except BaseException:
            end_group(process)
            raise
    if code != 0:
        words = "\n".join(log.read_text(errors="replace").strip().splitlines()[-LAST_LINES:])
        raise LaunchError(f"{command[0]} ended with exit code {code}: {words}")


def end_group(process: subprocess.Popen) -> None:
    """End a program that leads a process group, with all that it started; by force after ``GRACE`` seconds."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGTERM)
    try:
        process.wait(GRACE)
    except subprocess.TimeoutExpired:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
