"""Running the pipeline: Snakemake decides what is stale and starts the stages, one lock guards the run folder."""

import fcntl
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from workflow.inputs import read_record
from workflow.launch import end_group
from workflow.stage_table import BY_NAME, upstream

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
    """
    run_folder.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(run_folder / ".lock", os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise RunFolderBusy(f"another run is at work in {run_folder}") from error
        yield descriptor
    finally:
        os.close(descriptor)


def drive(run_folder: Path, until: str, cores: int, oversubscribe: bool, lock: int) -> bool:
    """Run every stale stage up to one; the inputs must have been written.

    Args:
        run_folder: folder of the run.
        until: name of the last stage.
        cores: number of cores that may be used.
        oversubscribe: whether MPI may have more ranks than cores.
        lock: what ``locked`` yields; Snakemake keeps it should this process be killed.

    Returns:
        Whether all went well; a stage that failed has said why.
    """
    run_folder = run_folder.resolve()
    command = [
        sys.executable, "-m", "snakemake", "--snakefile", str(SNAKEFILE), "--directory", str(run_folder),
        "--cores", str(cores), "--rerun-triggers", "mtime", "--rerun-incomplete", "--nolock", "--quiet", "all",
        "--config", f"run={run_folder}", f"oversubscribe={int(oversubscribe)}",
        "--", str(run_folder / BY_NAME[until].record),
    ]  # fmt: skip
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    process = subprocess.Popen(command, env=environment, start_new_session=True, pass_fds=(lock,))
    try:
        return process.wait() == 0
    except BaseException:
        end_group(process)
        raise


def failed_checks(run_folder: Path, until: str) -> list[str]:
    """List the health checks that did not hold, in words, of the stages up to one."""
    failures = []
    for name in upstream(until):
        record = read_record(run_folder, BY_NAME[name]) or {"health": {}}
        for check, result in record["health"].items():
            if not result["ok"]:
                failures.append(f"{name}: {check.replace('_', ' ')} {result['value']} exceeds {result['limit']}")
    return failures
