"""One fine joint among coarse ones, and the shock repeated with identical joints, which tells the shapes' influence."""

import json
import shutil
from pathlib import Path

import meshio
import numpy as np
import pytest

from reflowshock.workflow.board_drop.identical_joints import identical_sphere
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from tests.support.workflow_command import SMALL_CASE, reflowshock

SETTINGS = (
    "shock.ranks.total=1",
    "shock.identical_joints=true",
    "shock.coupling.fine_joints=['A4']",
    "shock.numerics.modes=['two_scale']",
)


@pytest.fixture(scope="module")
def identical_run(first_run, tmp_path_factory) -> Path:
    """Return a run of the shortened case with one fine joint, repeated with identical joints."""
    folder = shutil.copytree(first_run[0], tmp_path_factory.mktemp("identical") / "small")
    result = reflowshock("run", folder, settings=SETTINGS)
    assert result.returncode == 0, result.stdout + result.stderr
    return folder


def test_coarse_joints_have_coarse_meshes_and_checks(identical_run, first_run):
    summary = json.loads((identical_run / "summary.json").read_text())
    assert (identical_run / "solder_mesh/coarse_joints.msh").exists()
    assert summary["health"]["coarse_joint_volume_error_max"]["ok"]
    assert summary["effects"]["coarse_joints"]["on"]
    two_scale, dns = (
        json.loads((folder / "shock" / mode / "result.json").read_text())["model"]["elements"]
        for folder, mode in ((identical_run, "two_scale"), (first_run[0], "dns"))
    )
    assert sum(two_scale.values()) < sum(dns.values())


def test_the_fine_joint_agrees_with_the_dns(identical_run, first_run):
    """Within 30 us, before the board bends; 0.3 % in cases/bga_drop."""
    peaks = []
    for folder, mode in ((identical_run, "two_scale"), (first_run[0], "dns")):
        with np.load(folder / "shock" / mode / "history.npz") as history:
            stress = np.maximum(history["von_mises_board"], history["von_mises_package"])
            peaks.append(stress[:, history["joints"].tolist().index("A4")].max())
    assert peaks[0] == pytest.approx(peaks[1], rel=0.1)


def test_the_package_stands_flat_on_spheres_of_the_solders_volume(identical_run):
    height = identical_sphere(read_case(SMALL_CASE)).height
    mesh = meshio.read(identical_run / "solder_mesh/identical_assembly.msh")
    under = np.concatenate(
        [b.data[c].ravel() for b, c in zip(mesh.cells, mesh.cell_sets["package_side"], strict=True) if len(c)]
    )
    assert mesh.points[under, 2] == pytest.approx(height + 4e-5, abs=1e-15)
    assert json.loads((identical_run / "summary.json").read_text())["metrics"]["identical_joint_standoff"][
        "value"
    ] == pytest.approx(height)


def test_what_the_shapes_change_is_told(identical_run):
    summary = json.loads((identical_run / "summary.json").read_text())
    metrics = {name: metric["value"] for name, metric in summary["metrics"].items()}
    peaks = {}
    for run in ("two_scale", "identical"):
        with np.load(identical_run / f"shock/{run}/history.npz") as history:
            stress = np.maximum(history["peel_board"], history["peel_package"]).max(axis=0)
            peaks[run] = dict(zip(history["joints"].tolist(), stress.tolist(), strict=True))
    critical = metrics["critical_joint"]
    change = peaks["two_scale"][critical] / peaks["identical"][critical] - 1.0
    assert metrics["shape_effect_on_peak_stress"] == pytest.approx(change)
    assert metrics["peel_stress"] == peaks["two_scale"][critical]
    assert 0.001 < abs(change) < 0.2
    assert metrics["identical_critical_joint"] in peaks["identical"]
    assert summary["effects"]["identical_joints"]["on"]
    assert summary["health"]["identical_energy_balance_error"]["ok"]
    assert "identical truncated spheres" in (identical_run / "report.html").read_text()


def test_spheres_that_would_touch_are_refused():
    with pytest.raises(CaseError, match=r"shock.identical_joints = true.*the truncated spheres would touch"):
        read_case(SMALL_CASE, ["shock.identical_joints=true", "solder.volume=0.6 mm^3", "package.standoff=0.9 mm"])
