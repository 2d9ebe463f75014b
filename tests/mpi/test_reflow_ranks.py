"""Joints reflowed by MPI ranks equal those of processes; failures name the joint, and the next run continues."""

import time

import numpy as np
import psutil
import pytest

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.workflow.reflow.joints import JointReflow
from reflowshock.workflow.reflow.pool import ReflowError
from reflowshock.workflow.reflow.processes import Processes
from reflowshock.workflow.reflow.ranks import Ranks
from tests.support import rank_work

SOLDER = Solder(volume=7.2e-11, numerics=SolderNumerics(spacing=1.2e-4))
FLOWING = Solder(volume=7.2e-11, numerics=SolderNumerics(spacing=1e-4, scheme="ispg"), effects={"inertia": "on"})
PLACES = {
    "A1": JointGeometry(3.0e-4, 2.4e-4, 2.4e-4),
    "B1": JointGeometry(3.1e-4, 2.4e-4, 2.4e-4, (1e-5, 0.0), (0.01, 0.02)),
}


@pytest.fixture
def ranks(tmp_path):
    """Yield a pool of two MPI ranks; afterwards its folder is gone."""
    with Ranks(2, True, tmp_path / "ranks.jobs") as pool:
        yield pool
    assert not pool.folder.exists()


def jobs(folder, solder) -> dict[str, JointReflow]:
    """Return the reflow of each joint by name, with checkpoints in a folder."""
    return {name: JointReflow(geometry, solder, folder / name) for name, geometry in PLACES.items()}


def test_what_fails_is_named_and_all_end(ranks):
    begin = time.monotonic()
    with pytest.raises(ReflowError, match=r"^joint A2: ValueError: no rest after 3 steps$"):
        ranks.run(rank_work.fail, {"A1": "sleeps", "A2": "fails"}, lambda _: None)
    assert time.monotonic() - begin < 60.0
    left = [child.as_dict(["cmdline"])["cmdline"] for child in psutil.Process().children(recursive=True)]
    assert not [line for line in left if line and "reflowshock.workflow.reflow" in line]  # a zombie has no command line


def test_nothing_to_do_needs_no_rank(ranks):
    assert ranks.run(rank_work.fail, {}, lambda _: None) == {}


@pytest.mark.parametrize("solder", [SOLDER, pytest.param(FLOWING, marks=pytest.mark.long)], ids=["energy", "ispg"])
def test_a_rank_that_is_killed_ends_the_run_and_the_next_one_gives_what_processes_give(ranks, tmp_path, solder):
    with pytest.raises(ReflowError, match=r"(?s)mpirun was killed.*unfinished joints: (A1, )?B1"):
        ranks.run(rank_work.be_killed, jobs(tmp_path, solder), lambda _: None)
    assert not psutil.pid_exists(int((tmp_path / "B1.pid").read_text()))
    progress = []
    by_ranks = ranks.run(rank_work.solve, jobs(tmp_path, solder), lambda shares: progress.append(dict(shares)))
    with Processes(1, 1) as processes:
        by_processes = processes.run(rank_work.solve, jobs(tmp_path / "processes", solder), lambda _: None)
    assert list(by_ranks) == list(by_processes) == list(PLACES)
    assert [continued for _, continued in by_ranks.values()] == [True, False]
    assert progress[-1] == dict.fromkeys(PLACES, 1.0)
    for name, (shape, _) in by_ranks.items():
        other = by_processes[name][0]
        for array in ("points", "velocity", "pressure", "surface_points", "triangles"):
            np.testing.assert_array_equal(getattr(shape, array), getattr(other, array))
