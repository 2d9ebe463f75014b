"""A killed run continues from its checkpoints to the same bits on all ranks, fields included."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.parallel.checkpoint import Checkpoints
from reflowshock.fem.parallel.checkpoint_state import Same, State
from tests.support.fem_models import write_small_assembly
from tests.support.fem_program import MPIRUN
from tests.support.warm_start import warm_python

ROOT = Path(__file__).resolve().parents[2]
SHOCK = {
    "service_condition": "B",
    "duration": 1e-5,
    "gravity": "on",
    "damping": {"stiffness_coefficient": 1e-10, "mass_coefficient": 10.0},
    "ranks": {"placement": "disjoint"},
    "numerics": {
        "kinematics": "small",
        "mass_scaled": ["copper"],
        "history_samples": 100,
        "field_samples": 4,
        "checkpoint_seconds": 1e-9,
    },
}


@pytest.fixture(scope="module")
def assembly(tmp_path_factory) -> Path:
    """Return a folder with the meshes of a small package with one joint."""
    directory = tmp_path_factory.mktemp("restart")
    write_small_assembly(directory, 1, size=1e-3)
    return directory


def start(directory: Path, mode: str, output: Path, python: str = sys.executable) -> subprocess.Popen:
    """Write the input of a run and start it; return its process."""
    meshes = [str(directory / "assembly.msh"), str(directory / "joints.msh")]
    gauge, watch = {"at": [9e-3, 2e-3]}, {"at": [0.0, 0.0, -1e-3]}
    fitted = {"gauges": {"far": gauge}, "watch": {"under": watch}}
    request = {"mode": mode, "meshes": meshes, "shock": SHOCK, "output": str(output)}
    request |= {"materials": {"solder": "SAC405_elastic"}} | fitted
    path = directory / f"{output.name}.json"
    path.write_text(json.dumps(request | {"checkpoints": str(directory / f"{mode}.checkpoints")}))
    return subprocess.Popen(
        [*MPIRUN, "2", python, "-m", "reflowshock.fem", str(path)],
        cwd=ROOT,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def finish(process: subprocess.Popen) -> None:
    """Wait for the end of a process and check that it succeeded."""
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors


def kill_after_some_checkpoints(process: subprocess.Popen, folder: Path, count: int) -> None:
    """Kill a run as soon as it has written ``count`` checkpoints to a folder."""
    seen: set[tuple[str, int]] = set()
    while len(seen) < count:
        assert process.poll() is None, f"ended before it was killed: {process.stderr and process.stderr.read()}"
        for path in folder.glob("*/state-0001-?"):
            seen.add((path.name, path.stat().st_mtime_ns))
        time.sleep(0.001)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)


def test_killed_run_continues_to_the_same_bits(assembly):
    mode = "two_scale"
    whole, broken = assembly / f"{mode}_whole", assembly / f"{mode}_broken"
    folder = assembly / f"{mode}.checkpoints"
    process = start(assembly, mode, broken)
    kill_after_some_checkpoints(process, folder, 8)
    assert not (broken / "history.npz").exists()
    finish(start(assembly, mode, broken, warm_python()))
    assert json.loads((broken / "result.json").read_text())["continued_from"] > 0
    shutil.rmtree(folder)
    finish(start(assembly, mode, whole, warm_python()))
    with np.load(whole / "history.npz") as expected, np.load(broken / "history.npz") as actual:
        assert set(expected) == set(actual)
        for name in expected:
            assert np.array_equal(expected[name], actual[name]), name
    files = sorted(whole.glob("*.vtu")) + sorted(whole.glob("*.pvd"))
    assert len(files) >= 2 * 4
    for path in files:
        assert path.read_bytes() == (broken / path.name).read_bytes(), path.name


def checkpoints(folder: Path, inputs: object = "one") -> Checkpoints:
    """Return the checkpoints in a folder of a run with some inputs, on this process."""
    return Checkpoints(MPI.COMM_SELF, folder, inputs, 0.0)


def state(number: int | None = None) -> State:
    """Return a state for a checkpoint that contains one number; None for a state to be filled."""
    return {"model": {"number": Same(number)}}


def test_latest_whole_generation_of_the_same_inputs_is_read(tmp_path):
    files = checkpoints(tmp_path)
    assert files.read(state()) is None
    assert files.is_due()
    for window in (3, 5, 8):
        files.write(window, 0.5 * window, state(window))
    assert checkpoints(tmp_path).read(state()) == {"model": {"number": 8}}
    assert checkpoints(tmp_path, "other").read(state()) is None
    newest = max(tmp_path.glob("*/state-*"), key=lambda path: path.stat().st_mtime_ns)
    newest.write_bytes(newest.read_bytes()[:-1])
    again = checkpoints(tmp_path)
    assert again.read(state()) == {"model": {"number": 5}}
    assert (again.continued, again.latest.time, again.moved) == (5, 2.5, False)
    again.write(9, 4.5, state(9))
    assert checkpoints(tmp_path).read(state()) == {"model": {"number": 9}}


def test_without_a_folder_nothing_is_kept():
    files = Checkpoints(MPI.COMM_SELF, None, "one", 0.0)
    files.store("fields", state())
    files.write(1, 1e-6, state())
    assert not files.is_due()
    assert files.read(state()) is None
