"""The pool of processes: what is under way ends with an error, an interrupt, a kill; how it ended is said."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import psutil
import pytest

from reflowshock.processes import ProcessPool

ROOT = Path(__file__).resolve().parents[2]
LONG = 120.0
PARENT = """
import os, sys, time
from pathlib import Path
from reflowshock.processes import ProcessPool
from tests.unit.test_processes import sleep
if __name__ == "__main__":
    with ProcessPool(2) as pool:
        for k in range(2):
            pool.submit(sleep, Path(sys.argv[1]) / f"{k}.pid")
        time.sleep(120.0)
"""


def sleep(note: Path) -> None:
    """Say which process this is, then take long."""
    note.with_suffix(".new").write_text(str(os.getpid()))
    note.with_suffix(".new").rename(note)
    time.sleep(LONG)


def fall() -> None:
    """End like a process that has run out of memory."""
    os.kill(os.getpid(), signal.SIGKILL)


def pid(note: Path) -> int:
    """Wait for what `sleep` says."""
    for _ in range(600):
        if note.exists():
            return int(note.read_text())
        time.sleep(0.1)
    raise TimeoutError(note)


def test_the_end_of_a_block_waits():
    with ProcessPool(2) as pool:
        results = [pool.submit(abs, -k) for k in range(4)]
    assert [result.result() for result in results] == [0, 1, 2, 3]
    assert not multiprocessing.active_children()


def test_an_error_in_the_block_ends_what_is_under_way(tmp_path):
    with pytest.raises(ValueError, match="wrong"), ProcessPool(1) as pool:
        pool.submit(sleep, tmp_path / "pid")
        worker = pid(tmp_path / "pid")
        raise ValueError("wrong")
    assert not psutil.pid_exists(worker)


def test_how_a_process_ended_is_said():
    with pytest.raises(BrokenProcessPool), ProcessPool(1) as pool:
        try:
            pool.submit(fall).result()
        finally:
            assert pool.ending() == "exit code -9: it was killed, as the system does when memory is short"


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL], ids=lambda item: item.name)
def test_processes_end_with_their_parent(how, tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    heed = ("env", "--default-signal=INT")  # a job in the background of a shell ignores it
    parent = subprocess.Popen(
        [*heed, sys.executable, str(script), str(tmp_path)], env=environment, stderr=subprocess.PIPE
    )
    workers = [psutil.Process(pid(tmp_path / f"{k}.pid")) for k in range(2)]
    parent.send_signal(how)
    _, said = parent.communicate(timeout=60)
    gone, alive = psutil.wait_procs(workers, timeout=30)
    for item in alive:
        item.kill()
    assert not alive
    assert len(gone) == len(workers)
    assert said.count(b"KeyboardInterrupt") <= 1
