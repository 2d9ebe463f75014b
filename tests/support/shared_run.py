"""Runs that several tests need: the first of all workers that asks makes one, and all of them read it."""

import fcntl
import pickle
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.support.faults import run_drop
from tests.support.workflow_command import reflowshock

RUNS = {"small": lambda folder: reflowshock("run", folder), "drop": run_drop}


def shared_run(name: str, factory: pytest.TempPathFactory, worker: str) -> tuple[Path, CompletedProcess]:
    """Return the folder of a run that nobody changes, and how it ended.

    Args:
        name: of the run, among `RUNS`.
        factory: of pytest, whose folders of all workers lie side by side.
        worker: which of pytest-xdist this is; "master" without it.
    """
    base = factory.getbasetemp() if worker == "master" else factory.getbasetemp().parent
    folder, record = base / "shared" / name, base / "shared" / f"{name}.pickle"
    record.parent.mkdir(exist_ok=True)
    with record.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not record.exists():
            record.write_bytes(pickle.dumps(RUNS[name](folder)))
    return folder, pickle.loads(record.read_bytes())
