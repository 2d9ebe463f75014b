"""A program of which one process is stopped comes to an end, and says which."""

import os
import sys
import time

import pytest

from reflowshock.workflow.process.launch import LaunchError, launch, mpi_command

# Rank 1 stops itself; rank 0 waits for it in MPI, as in set-up, a solve or a window of one model.
RANKS = """
import os, signal
from mpi4py import MPI
if MPI.COMM_WORLD.rank == 1:
    os.kill(os.getpid(), signal.SIGSTOP)
MPI.COMM_WORLD.barrier()
"""


def test_a_rank_that_is_stopped_ends_the_run(tmp_path):
    start = time.monotonic()
    command = mpi_command(2, [sys.executable, "-c", RANKS], oversubscribe=True)
    with pytest.raises(LaunchError, match=r"^rank 1 \(process \d+\) had been stopped \(SIGSTOP\) for 1 s, so the run"):
        launch(command, print, tmp_path / "log.txt", 1.0)
    assert time.monotonic() - start < 30.0


def test_a_process_that_a_program_started_counts(tmp_path):
    program = "import subprocess, sys; sys.exit(subprocess.call(['sh', '-c', 'kill -STOP $$']) != 0)"
    with pytest.raises(LaunchError, match=r"^process \d+ had been stopped"):
        launch([sys.executable, "-c", program], print, tmp_path / "log.txt", 0.5)


def test_a_short_stop_is_no_error(tmp_path):
    program = "import os, signal, subprocess; subprocess.Popen(['sh', '-c', f'sleep 0.6; kill -CONT {os.getpid()}']); "
    program += "os.kill(os.getpid(), signal.SIGSTOP); print('on again')"
    lines: list[str] = []
    launch([sys.executable, "-c", program], lines.append, tmp_path / "log.txt", 20.0)
    assert lines == ["on again"]
    assert os.path.getsize(tmp_path / "log.txt") == 0
