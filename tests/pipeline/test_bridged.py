"""Overfilled array: touching joints are reported, reflowed and meshed as one, and excluded from the shock."""

import json

import pytest

from reflowshock.particles.scenes.products import read_shapes
from tests.support.workflow_command import reflowshock

OVERFILLED = ("solder.volume=0.26 mm^3", "solder.numerics.spacing=0.1 mm", "solder.numerics.time_step_limit=100")


@pytest.mark.long
def test_bridged_joints_are_told_and_end_the_run(tmp_path):
    result = reflowshock("run", tmp_path, settings=OVERFILLED)
    assert result.returncode == 1
    assert "joints bridged 4 (limit 0)" in result.stdout
    assert "A3" in result.stderr and "bridged: such a joint cannot be meshed" in result.stderr
    joints = json.loads((tmp_path / "reflow/joints.json").read_text())
    assert {joint["verdict"] for joint in joints.values()} == {"bridged"}
    assert "A4" in joints["A3"]["touches"]
    (bridge,) = [shape for name, shape in read_shapes(tmp_path / "reflow/shapes.h5").items() if "+" in name]
    assert bridge.verdict == "bridged"
    assert abs(bridge.metrics["volume_drift"][0]) < 1e-3
    meshes = json.loads((tmp_path / "solder_mesh/bridged_quality.json").read_text())
    assert len(meshes) == 1 and (tmp_path / "solder_mesh/bridged_joints.msh").exists()
    assert all(mesh["volume_error"] < 3e-3 and mesh["minimum_scaled_jacobian"] > 0.2 for mesh in meshes.values())
    assert reflowshock("report", tmp_path, settings=OVERFILLED).returncode == 0
    assert "as one body" in (tmp_path / "report.html").read_text()
    assert json.loads((tmp_path / "summary.json").read_text())["health"]["joints_bridged"]["value"] == 4
