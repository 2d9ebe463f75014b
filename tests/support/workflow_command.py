"""The command line as a subprocess, run to its end or interrupted, and the shortened case of the pipeline tests."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil

from reflowshock.workflow.package.case import BOARD_DROP
from tests.support.warm_start import warm_command

# Settings without influence on results: changing them must not rerun any stage.
WHO_COMPUTES = {"reflow.ranks", "shock.ranks.total", "shock.ranks.placement", "shock.ranks.macro"}
SMALL_CASE = Path(__file__).resolve().parents[1] / "pipeline" / "small.toml"


def command_line(command: str, folder: Path, *arguments: str, settings: tuple[str, ...] = ()) -> list[str]:
    """Return the command line of a command of the program on the shortened case, as words.

    Args:
        command: Name of the command.
        folder: Run folder, the value of ``--out``.
        arguments: Further arguments.
        settings: Values of ``--set``.
    """
    overrides = [item for setting in settings for item in ("--set", setting)]
    return [sys.executable, "-m", "reflowshock", command, str(SMALL_CASE), "--out", str(folder), *arguments, *overrides]


def reflowshock(
    command: str, folder: Path, *arguments: str, settings: tuple[str, ...] = ()
) -> subprocess.CompletedProcess:
    """Run a command of the program on the shortened case to its end; return the completed process.

    Args:
        command: Name of the command.
        folder: Run folder.
        arguments: Further arguments.
        settings: Values of ``--set``.
    """
    return warm_command(*command_line(command, folder, *arguments, settings=settings)[3:])


def times(folder: Path) -> dict[str, int]:
    """Return the modification time [ns] of the record of each completed stage of the shortened case."""
    records = {stage.name: folder / stage.record for stage in BOARD_DROP.stages}
    return {name: path.stat().st_mtime_ns for name, path in records.items() if path.exists()}


def wait_until(condition: Callable[[], bool], seconds: float = 400.0) -> None:
    """Wait until a function returns True; fail after ``seconds``, long enough for a loaded machine."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.05)


def break_off(line: list[str], folder: Path, end: signal.Signals, whom: str, *, pattern: str = "*") -> None:
    """Start a run and send it a signal as soon as the reflow has a matching checkpoint.

    The command must fail and leave no child process.

    Args:
        line: Command line as words.
        folder: Run folder.
        end: Signal.
        whom: Receiver of the signal, "command" or "stage".
        pattern: Pattern of the name of the checkpoint.
    """
    checkpoints = ".store/work/reflow-*/.reflow.checkpoints"
    process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    wait_until(lambda: any(path.suffix == "" for path in folder.glob(f"{checkpoints}/{pattern}")))
    children = psutil.Process(process.pid).children(recursive=True)
    for victim in [process] if whom == "command" else [child for child in children if "stage" in child.cmdline()]:
        victim.send_signal(end)
    errors = process.communicate(timeout=200)[1]
    assert psutil.wait_procs(children, timeout=60)[1] == []
    assert process.returncode == (-end if (end, whom) == (signal.SIGKILL, "command") else 1)
    assert end == signal.SIGKILL or b"repeat the command to continue" in errors
