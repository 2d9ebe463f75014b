"""A rank that dies, raises or stops ends all ranks, with its message and the checkpoint to continue from."""

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from reflowshock.fem.parallel.mpi_environment import without_mpi_job
from reflowshock.fem.parallel.status_board import ERROR
from reflowshock.workflow.process.launch import mpi_command
from tests.support.fem_models import write_small_assembly
from tests.support.fem_program import run_python

# The program with a failure of rank 1 in a window or in set-up, whose place is written to standard error.
SCRIPT = """
import os, signal, sys, time
from pathlib import Path
from mpi4py import MPI
from reflowshock.fem.run import time_loop
from reflowshock.fem.run import program
from reflowshock.fem.run import dynamics
from reflowshock.fem.errors import InvertedElementError

world, what, where = MPI.COMM_WORLD, sys.argv[2], sys.argv[3]
count = iter(range(10**9))

def misfortune():
    Path(sys.argv[1]).with_name("begin").write_text(str(time.time()))
    if what == "raise":
        raise ZeroDivisionError("broken rank")
    if what == "invert":
        raise InvertedElementError("element 7")
    if what == "exit":
        os._exit(3)
    os.kill(os.getpid(), getattr(signal, what))

def broken(real):
    def call(*arguments, **named):
        if world.rank == 1 and (where == "set-up" or next(count) == 20):
            misfortune()
        return real(*arguments, **named)
    return call

if where == "set-up":
    dynamics.make_history = broken(dynamics.make_history)
else:
    time_loop.run_window = broken(time_loop.run_window)
sys.exit(program.main(world, sys.argv[1:2]))
"""


@pytest.fixture(scope="module")
def assembly(tmp_path_factory) -> Path:
    """Return a folder with the meshes and the input of a shock on two ranks."""
    directory = tmp_path_factory.mktemp("failure")
    meshes = [str(path) for path in write_small_assembly(directory, 1, size=1e-3)]
    shock = {
        "service_condition": "B",
        "duration": 2e-5,
        "ranks": {"total": 2, "placement": "disjoint"},
        "numerics": {
            "kinematics": "small",
            "history_samples": 100,
            "field_samples": 2,
            "checkpoint_seconds": 1e-9,
            "watchdog_seconds": 2.0,
        },
    }
    request = {"mode": "two_scale", "meshes": meshes, "shock": shock, "output": str(directory / "out")}
    request |= {"materials": {"solder": "SAC405_elastic"}}
    (directory / "input.json").write_text(json.dumps(request))
    (directory / "script.py").write_text(SCRIPT)
    return directory


def loses_words() -> bool:
    """Return whether the launcher may lose the output of ranks once one has died, as Open MPI 5 does."""
    said = subprocess.run(["mpirun", "--version"], capture_output=True, text=True, check=True).stdout
    return int(re.search(r"Open MPI\D*(\d+)", said)[1]) >= 5


def errors_of(directory: Path, checkpoints: Path, what: str, where: str) -> str:
    """Return the error message of a run with a failing rank, in its file and, unless lost, on standard error."""
    path = checkpoints.parent / "input.json"
    path.write_text(json.dumps(json.loads((directory / "input.json").read_text()) | {"checkpoints": str(checkpoints)}))
    done = run_python([str(directory / "script.py"), str(path), what, where], 2)
    assert done.returncode != 0
    assert time.time() - float((checkpoints.parent / "begin").read_text()) < 30.0
    said = (directory / "out" / ERROR).read_text()
    error_lines = [[line for line in text.splitlines() if line.startswith("error: ")] for text in (said, done.stderr)]
    assert error_lines[0] == said.splitlines()[:1], said
    assert error_lines[1] == error_lines[0] or (not error_lines[1] and what == "exit" and loses_words()), done.stderr
    return said


@pytest.mark.parametrize(
    "what, message",
    [
        pytest.param("raise", "ZeroDivisionError: broken rank", marks=pytest.mark.long),
        ("invert", "error: rank 1: element 7"),
        pytest.param(
            "exit",
            r"error: rank 1 \((macro|meso)\) has died, all ranks are ended in window 2",
            marks=pytest.mark.long,
        ),
        ("SIGKILL", r"error: rank 1 \((macro|meso)\) has died, all ranks are ended in window 2"),
        (
            "SIGSTOP",
            r"rank 0 \((macro|meso)\): in window 21 it has waited [2-9] s for interface values from rank 1",
        ),
    ],
)
def test_misfortune_of_one_rank_ends_all(assembly, tmp_path, what, message):
    checkpoints = tmp_path / "checkpoints"
    said = errors_of(assembly, checkpoints, what, "window")
    assert re.search(message, said), said
    (folder,) = checkpoints.glob("*/")
    assert re.search(f"; last checkpoint: {folder} .window (1[5-9]|2[01]), time [0-9.]+e-06 s", said), said
    if what == "SIGSTOP":
        assert re.search(r"rank 1 \((macro|meso)\): no status for", said)


def test_a_rank_that_is_stopped_in_set_up_is_named(assembly, tmp_path):
    said = errors_of(assembly, tmp_path / "checkpoints", "SIGSTOP", "set-up")
    assert re.search(r"error: stopped \(SIGSTOP\) for 2 s \(watchdog_seconds\): rank 1", said), said


def test_misfortune_in_set_up_ends_all(assembly, tmp_path):
    said = errors_of(assembly, tmp_path / "checkpoints", "raise", "set-up")
    assert "ZeroDivisionError: broken rank" in said
    assert "checkpoint:" not in said


@pytest.mark.parametrize(
    ("raised", "words"), [("KeyboardInterrupt()", "rank 1: interrupted"), ("ImportError('libx')", "libx")]
)
def test_a_rank_that_fails_while_it_loads_libraries_ends_all(tmp_path, raised, words):
    """The other rank does not wait forever (found by an interrupt at a random time)."""
    (tmp_path / "sitecustomize.py").write_text(
        "import os, sys\n"
        "class Broken:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'reflowshock.fem.run.program' and os.environ.get('OMPI_COMM_WORLD_RANK') == '1':\n"
        f"            raise {raised}\n"
        "sys.meta_path.insert(0, Broken())\n"
    )
    environment = without_mpi_job(os.environ) | {"PYTHONPATH": os.pathsep.join([str(tmp_path), os.getcwd()])}
    line = mpi_command(2, [sys.executable, "-m", "reflowshock.fem", str(tmp_path / "absent.json")], True)
    ended = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode != 0
    assert loses_words() or words in ended.stderr
