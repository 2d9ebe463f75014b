"""Running Snakemake in a store: it starts the stages that are missing and ends with this process; its output."""

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

# How Snakemake says that a job failed: its message ends where the command, advice or the next entry begins.
FAILED = re.compile(r"^Error in (?:rule|group) .*?(?=^Error in |^\[|\Z)", re.MULTILINE | re.DOTALL)
MESSAGE = re.compile(
    r"^\s+message: (?P<why>.*?)\s*(?:sbatch call:|For further error details|\n    \w+:)", re.MULTILINE | re.DOTALL
)
OUTPUT = re.compile(r"^\s+output: (?P<mark>\S+)", re.MULTILINE)


SNAKEFILE = Path(__file__).parents[1] / "Snakefile"
SAID = "batch/snakemake.txt"  # what Snakemake says, below the store
LAST_LINES = 12


def snakemake(
    home: Path,
    executor: Executor,
    arguments: Sequence[str],
    lock: int,
    each_second: Callable[[], None] | None = None,
) -> bool:
    """Run Snakemake to its end; it ends with this process, and all stages with it, which have time to clean up.

    No path of the user's is on its command line or in its rules: all are relative to the store, in which it works.

    Args:
        home: the store's own folder.
        executor: where stages run.
        arguments: further ones.
        lock: what ``locked`` yields; Snakemake holds it, too.
        each_second: called while it runs, and once more in the end.

    Returns:
        Whether all went well.

    Raises:
        RunFolderBusy: jobs of an earlier command are still at work in the store.
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
    tell = each_second or (lambda: None)
    with (home / SAID).open("w") as said:
        process = subprocess.Popen(
            command, env=environment, cwd=home, stderr=said, start_new_session=True, pass_fds=(lock,)
        )
        try:
            while True:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(1.0 if each_second else None)
                tell()
                if process.returncode is not None:
                    return process.returncode == 0
        except BaseException:
            executor.end(process, home)
            raise


def last_words(home: Path) -> str:
    """Return the last lines that Snakemake said."""
    path = home / SAID
    lines = path.read_text(encoding="utf-8", errors="replace").strip().splitlines() if path.is_file() else []
    return "\n".join(lines[-LAST_LINES:])


class JobOutput:
    """Follows the files that take what jobs say."""

    def __init__(self, logs: Iterable[Path]) -> None:
        self._read = dict.fromkeys(logs, 0)

    def show(self) -> None:
        """Print the lines that are new."""
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


def failures_of(said: Path) -> dict[str, str]:
    """Return what Snakemake says of jobs that failed without a word of their own, as those that Slurm has ended.

    Args:
        said: file with the output of Snakemake.

    Returns:
        Name of the job -> why.
    """
    text = said.read_text(encoding="utf-8", errors="replace") if said.is_file() else ""
    found = {}
    for entry in FAILED.findall(text):
        why, mark = MESSAGE.search(entry), OUTPUT.search(entry)
        if why is not None and mark is not None and why["why"] != "None":
            found[Path(mark["mark"]).name] = why["why"]
    return found
