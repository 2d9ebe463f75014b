"""Some fine joints among coarse ones: found by a coarse run, reported, and reused until a key changes."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.workflow_command import reflowshock

pytestmark = pytest.mark.long  # one fine joint among coarse ones: test_identical_joints.py
CRITICAL = ("shock.ranks.total=1", "shock.coupling.fine_joints=critical", "shock.coupling.critical_joints=1")


@pytest.fixture(scope="module")
def critical_run(first_run, tmp_path_factory) -> Path:
    """Return a run of the shortened case with its most stressed joint fine."""
    import shutil

    folder = shutil.copytree(first_run[0], tmp_path_factory.mktemp("fine") / "small")
    result = reflowshock("run", folder, settings=CRITICAL)
    assert result.returncode == 0, result.stdout + result.stderr
    return folder


def test_a_coarse_run_finds_the_critical_joint_of_the_dns(critical_run):
    fine_joints = json.loads((critical_run / "shock/fine_joints.json").read_text())
    with np.load(critical_run / "shock/dns/history.npz") as dns:
        peel = np.maximum(dns["peel_board"], dns["peel_package"]).max(axis=0)
        pressed = np.maximum(dns["von_mises_board"], dns["von_mises_package"]).max(axis=0)
        names = [str(name) for name in dns["joints"]]
    assert fine_joints["names"] == [names[np.argmax(peel)]] == ["B3"]  # under the pulling die
    assert names[np.argmax(pressed)] == "A4"  # compressed in the first 30 us, hence without peel stress
    assert "run with coarse joints" in fine_joints["why"]


def test_coarse_joints_have_coarse_meshes_and_checks(critical_run):
    summary = json.loads((critical_run / "summary.json").read_text())
    assert (critical_run / "solder_mesh/coarse_joints.msh").exists()
    assert summary["health"]["coarse_joint_volume_error_max"]["ok"]
    assert summary["effects"]["coarse_joints"]["on"]
    elements = {mode: json.loads((critical_run / f"shock/{mode}/result.json").read_text())["model"]["elements"]
                for mode in ("two_scale", "dns")}  # fmt: skip
    assert sum(elements["two_scale"].values()) < sum(elements["dns"].values())


def test_the_fine_joint_agrees_with_the_dns(critical_run):
    summary = json.loads((critical_run / "summary.json").read_text())
    metrics = {name: metric["value"] for name, metric in summary["metrics"].items()}
    assert metrics["critical_joint_coarse"] == 0.0
    assert (
        metrics["critical_joint_stress_error"] <= 0.1
    )  # within 30 us, before the board bends; 0.3 % in cases/bga_drop
    assert metrics["die_displacement_error"] <= 0.05


def test_the_report_tells_of_two_scales(critical_run):
    page = (critical_run / "report.html").read_text()
    assert "<h2>Two scales</h2>" in page
    assert "selection of fine joints" in page
    assert "coarse" in page


def test_plan_says_that_joints_are_meshed_again_for_other_keys(critical_run):
    assert "up to date" in reflowshock("plan", critical_run, settings=CRITICAL).stdout
    text = reflowshock("plan", critical_run, settings=("shock.coupling.fine_joints=['A4']",)).stdout
    assert "shock.coupling.fine_joints: critical -> [A4]" in text
