"""Jobs for MPI ranks that reflow joints, importable by name in any process."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

from reflowshock.workflow.reflow import joints as reflow_pool
from reflowshock.workflow.reflow.joints import JointReflow, records

__all__ = ["records"]

Report = Callable[[float], None]


def solve(job: JointReflow, progress: Report):
    """Reflow a joint; return its shape, and whether it continued from a checkpoint.

    Args:
        job: Geometry, solder and checkpoint of the joint.
        progress: Function called with the fraction done, 0 to 1.
    """
    return reflow_pool._solve(job, progress)


def fail(job: str, progress: Report) -> str:
    """Raise ValueError for the job "fails"; report half of any other job as done and sleep."""
    if job == "fails":
        raise ValueError("no rest after 3 steps")
    progress(0.5)
    time.sleep(600)
    return job


def be_killed(job: JointReflow, progress: Report):
    """Reflow one joint; without solder kill the rank as soon as the other has written its checkpoint."""
    if job.checkpoint.name != "B1":
        return reflow_pool._solve(job, progress)
    while not (job.checkpoint.parent / "A1").exists():
        time.sleep(0.02)
    Path(job.checkpoint.parent / "B1.pid").write_text(str(os.getpid()))
    os.kill(os.getpid(), signal.SIGKILL)
    return None
