"""Running the pipeline: Snakemake decides what is stale and starts the stages, one lock guards the run folder."""

import fcntl
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from workflow.check_text import against_limit
from workflow.inputs import read_record
from workflow.launch import DIE_WITH_PARENT, end_group
from workflow.problems import CaseError, Problem
from workflow.stage_table import Stage

SNAKEFILE = Path(__file__).parent / "Snakefile"


class RunFolderBusy(RuntimeError):
    """Another process is running in the run folder."""


@contextmanager
def locked(run_folder: Path) -> Iterator[int]:
    """Hold the run folder's lock; the system releases it when this process and its Snakemake have ended, however.

    Yields:
        The file descriptor that holds the lock.

    Raises:
        RunFolderBusy: another process holds it.
        CaseError: the folder cannot be made or written to.
    """
    try:
        run_folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(run_folder / ".lock", os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        message, allowed = f"cannot be a run folder: {error.strerror}", "a folder that can be written to"
        raise CaseError("run", [Problem("--out", message, str(run_folder), allowed)]) from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise RunFolderBusy(f"another run is at work in {run_folder}") from error
        yield descriptor
    finally:
        os.close(descriptor)


def drive(run_folder: Path, until: Stage, cores: int, oversubscribe: bool, lock: int) -> bool:
    """Run every stale stage up to one; the inputs must have been written.

    Should this process be killed, Snakemake dies with it; each stage, which ends with Snakemake, has time to clean up.

    Args:
        run_folder: folder of the run.
        until: the last stage.
        cores: number of cores that may be used.
        oversubscribe: whether MPI may have more ranks than cores.
        lock: what ``locked`` yields; Snakemake holds it, too.

    Returns:
        Whether all went well; a stage that failed has said why.
    """
    run_folder = run_folder.resolve()
    wanted = ("--config", f"run={run_folder}", f"oversubscribe={int(oversubscribe)}", "--", run_folder / until.record)
    return snakemake(run_folder, cores, ["--snakefile", str(SNAKEFILE), *map(str, wanted)], lock)


def snakemake(
    folder: Path,
    cores: int,
    arguments: Sequence[str],
    lock: int,
    each_second: Callable[[], None] | None = None,
) -> bool:
    """Run Snakemake to its end; it dies with this process.

    Args:
        folder: where it works.
        cores: number of cores that may be used.
        arguments: further ones, its rules among them.
        lock: what ``locked`` yields; Snakemake holds it, too.
        each_second: called while it runs, and once more in the end.

    Returns:
        Whether all went well.
    """
    command = [
        *DIE_WITH_PARENT, sys.executable, "-m", "snakemake",
        "--directory", str(folder), "--cores", str(cores), "--rerun-triggers", "mtime", "--rerun-incomplete",
        "--nolock", "--quiet", "all", *arguments,
    ]  # fmt: skip
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    process = subprocess.Popen(command, env=environment, start_new_session=True, pass_fds=(lock,))
    tell = each_second or (lambda: None)
    try:
        while True:
            with suppress(subprocess.TimeoutExpired):
                process.wait(1.0 if each_second else None)
            tell()
            if process.returncode is not None:
                return process.returncode == 0
    except BaseException:
        end_group(process)
        raise


def failed_checks(run_folder: Path, stages: Sequence[Stage]) -> list[str]:
    """List the health checks of stages that did not hold, in words."""
    failures = []
    for stage in stages:
        record = read_record(run_folder, stage) or {"health": {}}
        for check, result in record["health"].items():
            if not result["ok"]:
                value, limit = against_limit(check, result)
                failures.append(f"{stage.name}: {check.replace('_', ' ')} {value}, limit {limit}")
    return failures
