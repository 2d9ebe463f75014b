"""Package that warps while it is heated, from its table of temperatures to the joints: one short run."""

import json
from pathlib import Path

import meshio
import numpy as np
import pytest

from reflowshock.meshing.board.displaced_assembly import read_displacement
from reflowshock.meshing.board.package_side import PackageSide
from reflowshock.meshing.board.pads import read_pads
from tests.support.mesh_file import MeshFile
from tests.support.warm_start import warm_command

CASE = Path(__file__).resolve().parents[2] / "cases/hu_bga_reflow/case.toml"
SHORT = (
    'scale="quick"', "thermal.steps=1", "solder.numerics.spacing=0.12 mm", "package.rows=4", "package.columns=4",
    "package.substrate.length=5 mm", "package.substrate.width=5 mm", "package.die.length=3 mm",
    "package.die.width=3 mm",
)  # fmt: skip


@pytest.fixture(scope="module")
def heated_run(tmp_path_factory) -> Path:
    """Return a run of example 4.3 of Hu et al. with 4 joints and few particles, to its report."""
    folder = tmp_path_factory.mktemp("heated") / "run"
    settings = [word for setting in SHORT for word in ("--set", setting)]
    result = warm_command("run", str(CASE), "--out", str(folder), *settings)
    assert result.returncode == 0, result.stdout + result.stderr
    return folder


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


def test_the_report_ends_with_the_joints(heated_run):
    summary = json.loads((heated_run / "summary.json").read_text())
    assert set(summary["timings"]["wall"]) == {"geometry", "reflow", "surface", "solder_mesh"}
    assert summary["metrics"]["standoff_spread"]["value"] > 1e-6
    assert all(check["ok"] for check in summary["health"].values())
    assert "von Mises at the pads" not in (heated_run / "report.html").read_text()
