"""Package that bows while it is heated: balance, products, joint meshes, and a kill during the exchange."""

import json
import signal
from pathlib import Path

import meshio
import numpy as np
import pytest

from reflowshock.meshing.board.displaced_assembly import read_displacement
from reflowshock.meshing.board.package_side import PackageSide
from reflowshock.meshing.board.pads import read_pads
from reflowshock.particles.scenes.products import read_shapes
from tests.support.mesh_file import MeshFile
from tests.support.warm_start import warm_command
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
CASE = Path(__file__).resolve().parents[2] / "cases/hu_bga_reflow/case.toml"
SHORT = (
    'scale="quick"', "thermal.steps=1", "solder.numerics.spacing=0.12 mm", "package.rows=4", "package.columns=4",
    "package.substrate.length=5 mm", "package.substrate.width=5 mm", "package.die.length=3 mm",
    "package.die.width=3 mm",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Return a run of the shortened case, whose package floats, to the joint meshes."""
    folder = tmp_path_factory.mktemp("heated")
    result = reflowshock("run", folder, "--until", "solder_mesh", settings=HEATED)
    assert result.returncode == 0, result.stdout + result.stderr
    return folder


@pytest.fixture(scope="module")
def published_run(tmp_path_factory) -> Path:
    """Return a run of example 4.3 of Hu et al. with 4 joints and few particles, to its report."""
    folder = tmp_path_factory.mktemp("heated") / "run"
    settings = [word for setting in SHORT for word in ("--set", setting)]
    result = warm_command("run", str(CASE), "--out", str(folder), *settings)
    assert result.returncode == 0, result.stdout + result.stderr
    return folder


@pytest.fixture(params=["folder", pytest.param("published_run", marks=pytest.mark.long)])
def heated_run(request) -> Path:
    """Return the run of the shortened case or of the published example."""
    return request.getfixturevalue(request.param)


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


def underside_of(run: Path) -> PackageSide:
    """Return the underside of the package from the displacement of the reflow."""
    mesh = MeshFile(run / "geometry/assembly.msh")
    points = mesh.points[np.unique(mesh.cells("package_side", "quad"))]
    return PackageSide.of_nodes(points, read_displacement(run / "reflow/structure.npz")(points))


def test_pads_of_the_joints_are_where_the_package_is(heated_run):
    """Gap, offset and tilt of each joint agree with the displaced nodes around its centre."""
    side, step = underside_of(heated_run), 1e-5
    for site in read_pads(heated_run / "reflow/pads.json"):
        x, y = (
            site.x + site.offset[0] + step * np.array([0, 1, -1, 0, 0]),
            site.y + site.offset[1] + step * np.array([0, 0, 0, 1, -1]),
        )
        heights = side.height(x, y)
        assert heights[0] - site.z_board - 2e-5 == pytest.approx(site.gap, abs=0.5e-6)
        slopes = (heights[1] - heights[2]) / (2.0 * step), (heights[3] - heights[4]) / (2.0 * step)
        assert slopes == pytest.approx((-site.tilt[1], site.tilt[0]), abs=3e-4)
        assert max(abs(angle) for angle in site.tilt) > 5e-4


def test_the_assembly_is_displaced_by_what_the_reflow_computed(heated_run):
    flat, displaced = (MeshFile(heated_run / name) for name in ("geometry/assembly.msh", "solder_mesh/assembly.msh"))
    move = read_displacement(heated_run / "reflow/structure.npz")
    for part in ("substrate", "die"):
        before, after = (mesh.points[mesh.cells(part)].reshape(-1, 3) for mesh in (flat, displaced))
        assert after == pytest.approx(before + move(before), abs=1e-15)
    assert np.array_equal(flat.points[flat.cells("board")], displaced.points[displaced.cells("board")])


def test_heads_of_the_joints_reach_it_almost_without_a_shear(heated_run):
    quality = json.loads((heated_run / "solder_mesh/quality.json").read_text())
    assert max(joint["head_mismatch"] for joint in quality.values()) < 0.5e-6
    joints = meshio.read(heated_run / "solder_mesh/joints.msh")
    assert {f"solder@{name}" for name in quality} <= set(joints.field_data)


@pytest.mark.long
def test_the_report_ends_with_the_joints(published_run):
    summary = json.loads((published_run / "summary.json").read_text())
    assert set(summary["timings"]["wall"]) == {"geometry", "reflow", "surface", "solder_mesh"}
    assert summary["metrics"]["standoff_spread"]["value"] > 1e-6
    assert all(check["ok"] for check in summary["health"].values())
    assert "von Mises at the pads" not in (published_run / "report.html").read_text()
