"""Floating package that bows while it is heated: balance, products, and a kill during the exchange."""

import json
import signal

import meshio
import numpy as np
import pytest

from reflowshock.meshing.board.pads import read_pads
from reflowshock.particles.scenes.products import read_shapes
from tests.support.workflow_command import break_off, command_line, reflowshock

HEATED = (
    "warpage.corner=0 mm",
    "thermal.melting=100 degC",
    "thermal.peak=200 degC",
    "thermal.solidification=200 degC",
    "thermal.steps=1",
    "thermal.effects.solder_force=on",
    "solder.numerics.time_step_limit=100",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return the run folder of a heated package, run to the end of its reflow."""
    folder = tmp_path_factory.mktemp("heated")
    result = reflowshock("run", folder, "--until", "reflow", settings=HEATED)
    assert result.returncode == 0, result.stdout + result.stderr
    return folder


def test_each_load_step_is_in_balance(folder):
    record = json.loads((folder / "reflow/stage.json").read_text())
    assert record["health"]["coupling_residual_max"]["value"] <= 1e-3
    assert record["effects"]["flexible"]["on"] and record["effects"]["solder_force"]["on"]
    structure = np.load(folder / "reflow/structure.npz")
    assert structure["temperature"] - 273.15 == pytest.approx([100.0, 200.0])
    assert (structure["iterations"] > 1).all()
    assert max(structure["force_residual"].max(), structure["rigid_residual"].max()) <= 1e-3
    assert abs(record["metrics"]["standoff_spread_without_solder"]["value"]) > 1e-6
    assert record["metrics"]["joint_width_error_max"]["value"] < 0.01


def test_pads_joints_and_structure_tell_the_same(folder):
    """The pads of the package follow its nodes, and the joints follow their pads."""
    pads, joints = read_pads(folder / "reflow/pads.json"), json.loads((folder / "reflow/joints.json").read_text())
    drawn = {pad.name: pad for pad in read_pads(folder / "geometry/pads.json")}
    structure = np.load(folder / "reflow/structure.npz")
    last = dict(zip(structure["joints"], structure["pad_motion"][-1], strict=True))
    for pad in pads:
        joint_place = joints[pad.name]["place"]
        assert (pad.gap, *pad.offset, *pad.tilt) == (joint_place["gap"], *joint_place["offset"], *joint_place["tilt"])
        board, package = last[pad.name]
        assert pad.gap - drawn[pad.name].gap == pytest.approx(package[2] - board[2], abs=1e-8)
        assert np.hypot(*pad.tilt) > 0.0
    assert np.ptp([pad.gap for pad in pads]) > 1e-6
    pictured = meshio.read(folder / "reflow/structure.vtu")
    assert abs(pictured.point_data["displacement"][:, 2]).max() == pytest.approx(
        abs(structure["displacement"][:, 2]).max(), rel=1e-6
    )


@pytest.mark.long
def test_a_kill_in_the_midst_of_an_exchange_changes_nothing(folder, tmp_path):
    """After kill -9 of the stage in the third exchange, shapes and products are equal to the bit."""
    line = command_line("run", tmp_path, "--until", "reflow", settings=HEATED)
    break_off(line, tmp_path, signal.SIGKILL, "stage", pattern="*@2")
    result = reflowshock("run", tmp_path, "--until", "reflow", settings=HEATED)
    assert result.returncode == 0, result.stderr
    assert "continued from checkpoints" in " ".join(result.stdout.split())
    assert not list((tmp_path / ".store/work").iterdir())
    expected, actual = (read_shapes(run / "reflow/shapes.h5") for run in (folder, tmp_path))
    assert actual.keys() == expected.keys()
    for name, shape in expected.items():
        assert np.array_equal(actual[name].points, shape.points)
        assert np.array_equal(actual[name].history["energy"], shape.history["energy"])
    assert (tmp_path / "reflow/pads.json").read_bytes() == (folder / "reflow/pads.json").read_bytes()
    fields = [np.load(run / "reflow/structure.npz") for run in (folder, tmp_path)]
    for key in ("displacement", "pad_motion", "iterations", "force_residual"):
        assert np.array_equal(fields[0][key], fields[1][key])
