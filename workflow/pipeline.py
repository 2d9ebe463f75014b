"""Running the pipeline: Snakemake decides what is stale and starts the stages, one lock guards the run folder."""

import fcntl
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from workflow.case_kind import Case
from workflow.check_text import against_limit
from workflow.cluster.executor import SAID, Executor
from workflow.cluster.job_output import JobOutput
from workflow.inputs import read_record
from workflow.problems import CaseError, Problem
from workflow.products import write_json
from workflow.stage_table import Stage
from workflow.terminal import print_error

SNAKEFILE = Path(__file__).parent / "Snakefile"
JOBS = "inputs/jobs.json"  # stage -> resources of its job, where stages are jobs


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


def drive(run_folder: Path, case: Case, until: str, executor: Executor, lock: int) -> bool:
    """Run every stale stage up to one; the inputs must have been written.

    Args:
        run_folder: folder of the run.
        case: the case.
        until: the last stage.
        executor: where stages run.
        lock: what ``locked`` yields; Snakemake holds it, too.

    Returns:
        Whether all went well; a stage that failed has said why.

    Raises:
        RunFolderBusy: jobs of an earlier command are still at work.
    """
    run_folder, jobs = run_folder.resolve(), executor.jobs(case)
    arguments = ["--snakefile", str(SNAKEFILE), "--config", f"run={run_folder}"]
    arguments.append(f"oversubscribe={int(executor.oversubscribe)}")
    wanted = ["--", str(run_folder / case.pipeline[until].record)]
    if not jobs:
        return snakemake(run_folder, executor, [*arguments, *wanted], lock)
    write_json(run_folder / JOBS, jobs)
    output = JobOutput(run_folder, [stage.name for stage in case.pipeline.upstream(until)])
    done = snakemake(run_folder, executor, [*arguments, f"jobs={run_folder / JOBS}", *wanted], lock, output.show)
    for message in () if done else output.untold(run_folder / SAID):
        print_error(message)
    return done


def snakemake(
    folder: Path,
    executor: Executor,
    arguments: Sequence[str],
    lock: int,
    each_second: Callable[[], None] | None = None,
) -> bool:
    """Run Snakemake to its end; it ends with this process, and all stages with it, which have time to clean up.

    Args:
        folder: where it works.
        executor: where stages run.
        arguments: further ones, its rules among them.
        lock: what ``locked`` yields; Snakemake holds it, too.
        each_second: called while it runs, and once more in the end.

    Returns:
        Whether all went well.

    Raises:
        RunFolderBusy: jobs of an earlier command are still at work in the folder.
    """
    jobs = " ".join(executor.left_over(folder))
    if jobs:
        raise RunFolderBusy(f"jobs of an earlier command are at work in {folder}: wait for them, or: scancel {jobs}")
    command = [
        *executor.guard, sys.executable, "-m", "snakemake", *executor.options,
        "--directory", str(folder), "--rerun-triggers", "mtime", "--rerun-incomplete", "--nolock", *arguments,
    ]  # fmt: skip
    environment = os.environ | {"OMP_NUM_THREADS": "1"} | executor.environment
    tell = each_second or (lambda: None)
    with _opened(executor.output(folder)) as said:
        process = subprocess.Popen(
            command, env=environment, stdout=said, stderr=said, start_new_session=True, pass_fds=(lock,)
        )
        try:
            while True:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(1.0 if each_second else None)
                tell()
                if process.returncode is not None:
                    return process.returncode == 0
        except BaseException:
            executor.end(process, folder)
            raise


@contextmanager
def _opened(path: Path | None) -> Iterator[IO | None]:
    """Open a file for writing, with its folder, where there is one."""
    if path is None:
        yield None
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8") as file:
        yield file


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
