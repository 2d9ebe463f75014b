"""Bitwise restart of an interrupted run, and rejection of foreign checkpoint files."""

import signal
import subprocess
import sys
from dataclasses import fields

import numpy as np
import pytest

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.scenes.reflow import solve_joint
from tests.support.forged_files import DAMAGES

JOINT = JointGeometry(0.31e-3, 0.24e-3, 0.24e-3)
COARSE = SolderNumerics(spacing=1e-4)
QUASI_STATIC = Solder(volume=0.0724e-9, numerics=COARSE)
INERTIAL = Solder(volume=0.0724e-9, numerics=COARSE, effects=SolderEffects(inertia="on", viscosity="on"))
CLOCK = ("seconds", "particle_steps_per_second")
BREAK = 5

PROGRAM = """
import os, sys
from pathlib import Path
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.scenes.reflow import solve_joint

joint, solder, steps = JointGeometry(*map(float, sys.argv[2:5])), Solder.model_validate_json(sys.argv[5]), []

def kill(_):
    steps.append(1)
    if len(steps) == int(sys.argv[6]):
        os.kill(os.getpid(), int(sys.argv[7]))

solve_joint(joint, solder, kill, checkpoint=Checkpoint(Path(sys.argv[1]), (joint, solder), 0.0))
"""


class BrokenOff(Exception):
    pass


def break_off(solder, path, steps=BREAK):
    """Start the reflow of a joint with a checkpoint file and interrupt it after some steps."""
    calls = []

    def stop(_):
        calls.append(1)
        if len(calls) == steps:
            raise BrokenOff

    with pytest.raises(BrokenOff):
        solve_joint(JOINT, solder, stop, checkpoint=Checkpoint(path, (JOINT, solder), 0.0))


def check_equal(actual, expected):
    """Check that two shapes are equal to the bit, histories included."""
    for field in fields(expected):
        expected_value = getattr(expected, field.name)
        if isinstance(expected_value, np.ndarray):
            assert np.array_equal(getattr(actual, field.name), expected_value), field.name
    assert all(np.array_equal(actual.history[name], column) for name, column in expected.history.items())
    assert len(actual.snapshots) == len(expected.snapshots)
    for snapshot, other in zip(actual.snapshots, expected.snapshots, strict=True):
        assert snapshot.time == other.time
        assert np.array_equal(snapshot.points, other.points)
    assert {name: value for name, value in actual.metrics.items() if name not in CLOCK} == {
        name: value for name, value in expected.metrics.items() if name not in CLOCK
    }
    assert actual.verdict == expected.verdict


@pytest.fixture(scope="module")
def uninterrupted():
    """Return the shape of the joint without interruption."""
    return solve_joint(JOINT, QUASI_STATIC)


@pytest.mark.parametrize("end", [pytest.param(signal.SIGTERM, marks=pytest.mark.long), signal.SIGKILL])
def test_a_killed_process_is_continued_to_the_last_bit(tmp_path, uninterrupted, end):
    path = tmp_path / "joint"
    discs = (str(size) for size in (JOINT.gap, JOINT.radius_board, JOINT.radius_package))
    arguments = (str(path), *discs, QUASI_STATIC.model_dump_json(), str(BREAK), str(int(end)))
    killed = subprocess.run([sys.executable, "-c", PROGRAM, *arguments], timeout=120, check=False)
    assert killed.returncode == -end
    checkpoint = Checkpoint(path, (JOINT, QUASI_STATIC))
    check_equal(solve_joint(JOINT, QUASI_STATIC, checkpoint=checkpoint), uninterrupted)
    assert checkpoint.continued


@pytest.mark.long
def test_momentum_and_contact_lines_are_part_of_the_state(tmp_path):
    break_off(INERTIAL, tmp_path / "joint", 10)
    continued = solve_joint(JOINT, INERTIAL, checkpoint=Checkpoint(tmp_path / "joint", (JOINT, INERTIAL)))
    check_equal(continued, solve_joint(JOINT, INERTIAL))


def test_a_finished_run_is_not_run_again(tmp_path, uninterrupted):
    path, steps = tmp_path / "joint", []
    solve_joint(JOINT, QUASI_STATIC, checkpoint=Checkpoint(path, (JOINT, QUASI_STATIC)))
    again = solve_joint(JOINT, QUASI_STATIC, steps.append, checkpoint=Checkpoint(path, (JOINT, QUASI_STATIC)))
    assert steps == [1.0]
    check_equal(again, uninterrupted)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.5, 0.999])
def test_a_truncated_file_is_ignored_with_a_message(tmp_path, caplog, share):
    path = tmp_path / "joint"
    Checkpoint(path, ("inputs",)).write(np.arange(1000))
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    checkpoint = Checkpoint(path, ("inputs",))
    assert checkpoint.read() is None
    assert "is truncated" in caplog.text
    assert not checkpoint.continued


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_broken_or_foreign_file_starts_the_run_anew(tmp_path, caplog, damage):
    path, marker = tmp_path / "joint", tmp_path / "marker"
    Checkpoint(path, ("inputs",)).write({"points": np.arange(1000.0)})
    path.write_bytes(damage(path.read_bytes(), marker))
    checkpoint = Checkpoint(path, ("inputs",))
    assert checkpoint.read() is None
    assert f"{path}" in caplog.text
    assert "the run starts from the beginning" in caplog.text
    assert not checkpoint.continued
    assert not marker.exists()


@pytest.mark.parametrize("damage", [DAMAGES["pickle"], DAMAGES["pickled array"]])
def test_a_reflow_beside_a_forged_checkpoint_starts_anew(tmp_path, caplog, uninterrupted, damage):
    path, marker = tmp_path / "joint", tmp_path / "marker"
    break_off(QUASI_STATIC, path)
    path.write_bytes(damage(path.read_bytes(), marker))
    checkpoint = Checkpoint(path, (JOINT, QUASI_STATIC))
    check_equal(solve_joint(JOINT, QUASI_STATIC, checkpoint=checkpoint), uninterrupted)
    assert not checkpoint.continued
    assert "the run starts from the beginning" in caplog.text
    assert not marker.exists()


def test_a_file_of_other_inputs_is_ignored_with_a_message(tmp_path, caplog):
    path = tmp_path / "joint"
    Checkpoint(path, (JOINT, QUASI_STATIC)).write("state")
    assert Checkpoint(path, (JOINT, INERTIAL)).read() is None
    assert "other inputs" in caplog.text
    assert Checkpoint(path, (JOINT, QUASI_STATIC)).read() == "state"


def test_a_file_of_other_code_is_ignored(tmp_path, monkeypatch):
    path = tmp_path / "joint"
    Checkpoint(path, ()).write("state")
    monkeypatch.setattr("reflowshock.particles.core.checkpoint._code", lambda: b"another version")
    assert Checkpoint(path, ()).read() is None


def test_a_write_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    checkpoint = Checkpoint(tmp_path / "joint", ())
    checkpoint.write("old")

    def fail(_):
        raise OSError("no space")

    monkeypatch.setattr("reflowshock.data_file.os.fsync", fail)
    with pytest.raises(OSError, match="no space"):
        checkpoint.write("new")
    assert checkpoint.read() == "old"
