"""Snakemake in a store: starting it, ending it with this process, and reading its output."""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path

from reflowshock.workflow.jobs.executor import Executor
from reflowshock.workflow.process.terminal import console
from reflowshock.workflow.store.folders import RunFolderBusy

# Failure entries of Snakemake: the message ends where the command, advice or the next entry begins.
FAILED = re.compile(r"^Error in (?:rule|group) .*?(?=^Error in |^\[|\Z)", re.MULTILINE | re.DOTALL)
MESSAGE = re.compile(
    r"^\s+message: (?P<why>.*?)\s*(?:sbatch call:|For further error details|\n    \w+:)", re.MULTILINE | re.DOTALL
)
OUTPUT = re.compile(r"^\s+output: (?P<mark>\S+)", re.MULTILINE)


SNAKEFILE = Path(__file__).parents[1] / "Snakefile"
SNAKEMAKE_LOG = "batch/snakemake.txt"  # output of Snakemake, relative to the store
LAST_LINES = 12


def snakemake(
    home: Path,
    executor: Executor,
    arguments: Sequence[str],
    lock: int,
    each_second: Callable[[], None] | None = None,
) -> bool:
    """Run Snakemake to its end; if this process ends first, Snakemake and all stages are ended in an orderly way.

    All paths on its command line and in its rules are relative to the store, its working directory.

    Args:
        home: Folder of the store.
        executor: Executor of the stages.
        arguments: Additional arguments of Snakemake.
        lock: File descriptor from ``locked``, inherited by Snakemake.
        each_second: Function called every second while Snakemake runs, and once at the end.

    Returns:
        Whether all jobs succeeded.

    Raises:
        RunFolderBusy: Jobs of an earlier command are still running in the store.
    """
    jobs = " ".join(executor.left_over(home))
    if jobs:
        raise RunFolderBusy(
            f"jobs of an earlier command are still running in {home}: wait for them, or use: scancel {jobs}"
        )
    command = [
        *executor.guard, sys.executable, "-m", "snakemake", *executor.options, "--snakefile", str(SNAKEFILE),
        "--rerun-triggers", "mtime", "--rerun-incomplete", "--nolock", "--keep-going", *arguments,
    ]  # fmt: skip
    environment = os.environ | {"OMP_NUM_THREADS": "1"} | executor.environment
    report_progress = each_second or (lambda: None)
    with (home / SNAKEMAKE_LOG).open("w") as log:
        process = subprocess.Popen(
            command, env=environment, cwd=home, stderr=log, start_new_session=True, pass_fds=(lock,)
        )
        try:
            while True:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(1.0 if each_second else None)
                report_progress()
                if process.returncode is not None:
                    return process.returncode == 0
        except BaseException:
            executor.end(process, home)
            raise


def last_lines(home: Path) -> str:
    """Return the last lines of Snakemake's log in the folder of a store; empty without a log."""
    path = home / SNAKEMAKE_LOG
    lines = path.read_text(encoding="utf-8", errors="replace").strip().splitlines() if path.is_file() else []
    return "\n".join(lines[-LAST_LINES:])


class JobOutput:
    """Reader that follows the log files of jobs."""

    def __init__(self, logs: Iterable[Path]) -> None:
        self._read = dict.fromkeys(logs, 0)

    def show(self) -> None:
        """Print the lines that are new since the last call."""
        for path, done in self._read.items():
            if not path.is_file():
                continue
            with path.open("rb") as file:
                file.seek(done)
                new = file.read()
            complete = new[: new.rfind(b"\n") + 1]
            self._read[path] = done + len(complete)
            for line in complete.decode(errors="replace").splitlines():
                console.print(line, soft_wrap=True)


def failures_of(log: Path) -> dict[str, str]:
    """Return Snakemake's messages about failed jobs that left no message, such as jobs ended by Slurm.

    Args:
        log: File with the output of Snakemake.

    Returns:
        Name of the job, ``<stage>-<key>`` -> message; empty without failures.
    """
    text = log.read_text(encoding="utf-8", errors="replace") if log.is_file() else ""
    reasons = {}
    for entry in FAILED.findall(text):
        why, mark = MESSAGE.search(entry), OUTPUT.search(entry)
        if why is not None and mark is not None and why["why"] != "None":
            reasons[Path(mark["mark"]).name] = why["why"]
    return reasons
