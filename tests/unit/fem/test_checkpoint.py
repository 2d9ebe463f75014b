"""Broken or forged checkpoint files of a shock are reported, never executed, and replaced by an older generation."""

import json
import re

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.coupling.planner import COST_FILE, stored_costs
from reflowshock.fem.parallel.checkpoint import Checkpoints
from reflowshock.fem.parallel.checkpoint_state import Log, Rows, Same, Shares, Sum
from reflowshock.fem.run import time_loop
from reflowshock.fem.run.structure import run_structure
from tests.support.fem_structures import structure_input
from tests.support.forged_files import DAMAGES

NODES = np.array([4, 7, 9])
NUMERICS = {"history_samples": 20, "field_samples": 3, "checkpoint_seconds": 1e-9}


class Killed(Exception):
    """Exception in place of a kill."""


def state(window: int) -> dict:
    """Return the state of two models after a number of windows."""
    points = np.full((3, 3), float(window))
    return {
        "macro": {"displacement": Rows(NODES, points), "force": Shares(NODES, points, NODES > 4), "work": Sum(0.5)},
        "history": {"balance": Same({"limit": 0.01}), "rows": Log({"time": np.arange(window)})},
    }


def checkpoints(folder) -> Checkpoints:
    """Return the checkpoints in a folder, on this process."""
    return Checkpoints(MPI.COMM_SELF, folder, "inputs", 0.0)


def written(folder) -> Checkpoints:
    """Write two generations, each with its own file of fields."""
    files = checkpoints(folder)
    files.read(state(0))
    for window in (3, 5):
        files.store(f"macro-{window}", {"macro": {"time": Same(window)}})
        files.write(window, 0.5 * window, state(window))
    return files


def damage_files(folder, pattern, damage, marker) -> None:
    """Damage the only file in a folder that matches a pattern."""
    (path,) = folder.glob(pattern)
    path.write_bytes(damage(path.read_bytes(), marker))


def warnings(said: str) -> list[str]:
    """Return the warnings among the lines of an output."""
    return [json.loads(line)["warning"] for line in said.splitlines() if line.startswith('{"warning"')]


def test_a_state_comes_back_as_it_was(tmp_path):
    written(tmp_path)
    files = checkpoints(tmp_path)
    restored = files.read(state(0))
    assert files.continued == 5
    assert restored["history"]["balance"] == {"limit": 0.01}
    assert (restored["macro"]["displacement"] == 5.0).all()
    assert restored["macro"]["work"] == 0.5
    assert files.stored("macro-3", {"macro": {"time": Same(None)}}) == {"macro": {"time": 3}}


@pytest.mark.parametrize("pattern", ["*/state-0000-1", "*/macro-5-0000"])
@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_the_older_generation_is_taken_where_a_file_is_broken_or_forged(tmp_path, capsys, damage, pattern):
    folder, marker = tmp_path / "checkpoints", tmp_path / "marker"
    written(folder)
    damage_files(folder, pattern, damage, marker)
    files = checkpoints(folder)
    restored = files.read(state(0))
    assert (restored["macro"]["displacement"] == 3.0).all()
    assert files.continued == 3
    (warning,) = warnings(capsys.readouterr().out)
    assert re.search("state-0000-1|macro-5-0000", warning)
    assert not marker.exists()


def test_files_of_other_inputs_are_no_reason_for_a_warning(tmp_path, capsys):
    written(tmp_path)
    assert Checkpoints(MPI.COMM_SELF, tmp_path, "others", 0.0).read(state(0)) is None
    assert not warnings(capsys.readouterr().out)


@pytest.mark.parametrize("damage", [DAMAGES["pickle"], DAMAGES["pickled array"], DAMAGES["truncated"]])
def test_a_shock_beside_forged_checkpoints_starts_anew(tmp_path, capsys, monkeypatch, damage):
    """All files of the folder are forged, so no generation is valid."""
    marker = tmp_path / "marker"
    request = structure_input(tmp_path, dynamics={"duration": 2e-5, "numerics": NUMERICS})
    request = request.model_copy(update={"checkpoints": tmp_path / "checkpoints"})
    windows, real = iter(range(11)), time_loop.run_window

    def run_window(participants, stopwatch) -> None:
        if next(windows, None) is None:
            raise Killed
        real(participants, stopwatch)

    with monkeypatch.context() as patch:
        patch.setattr(time_loop, "run_window", run_window)
        with pytest.raises(Killed):
            run_structure(MPI.COMM_SELF, request)
    files = [path for path in request.checkpoints.glob("*/*") if path.is_file()]
    assert len(files) >= 3
    for path in files:
        path.write_bytes(damage(path.read_bytes(), marker))
    capsys.readouterr()
    run_structure(MPI.COMM_SELF, request)
    assert len(warnings(capsys.readouterr().out)) >= 2
    assert json.loads((request.output / "result.json").read_text())["continued_from"] == 0
    assert not marker.exists()


@pytest.mark.parametrize("content", [b"", b"[1, 2]", b'{"fixed": [1.0]', b'{"fixed": 1, "element": [], "latency": 0}'])
def test_a_broken_measurement_of_speeds_is_taken_again(tmp_path, capsys, content):
    (tmp_path / COST_FILE).write_bytes(content)
    assert stored_costs(MPI.COMM_WORLD, tmp_path, np.array([0], np.int8)) is None
    assert "measured again" in warnings(capsys.readouterr().out)[0]
