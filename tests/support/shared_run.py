"""Runs shared by several tests: the first worker that asks makes the run, all others read it."""

import fcntl
import pickle
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.support.faults import run_drop
from tests.support.workflow_command import reflowshock

RUNS = {"small": lambda folder: reflowshock("run", folder), "drop": run_drop}


def shared_run(name: str, factory: pytest.TempPathFactory, worker: str) -> tuple[Path, CompletedProcess]:
    """Return the folder of a read-only run and its completed process.

    Args:
        name: Name of the run in ``RUNS``.
        factory: Factory of temporary folders, whose parents are shared by all workers.
        worker: Name of the pytest-xdist worker; "master" without xdist.
    """
    base = factory.getbasetemp() if worker == "master" else factory.getbasetemp().parent
    folder, record = base / "shared" / name, base / "shared" / f"{name}.pickle"
    record.parent.mkdir(exist_ok=True)
    with record.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not record.exists():
            record.write_bytes(pickle.dumps(RUNS[name](folder)))
    return folder, pickle.loads(record.read_bytes())
