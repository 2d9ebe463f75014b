"""Drops and joints from case file to report, shortened."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

CASES = Path(__file__).resolve().parents[2] / "cases"
COARSE_DROP, COARSE_JOINT = "drop.particles_per_edge=7", "joint.spacing=0.06 mm"
ALWAYS = {
    "height", "max_width", "contact_radius", "contact_angle", "volume_drift", "mean_pressure", "pressure_scatter",
    "capillary_number_at_rest", "time_step_over_capillary_limit", "particles", "particle_steps_per_second", "seconds",
    "max_width_error", "verdict",
}  # fmt: skip


def run(name: str, folder: Path, *settings: str) -> subprocess.CompletedProcess:
    line = [sys.executable, "-m", "workflow", "run", str(CASES / name / "case.toml"), "--out", str(folder)]
    overrides = [item for setting in settings for item in ("--set", setting)]
    return subprocess.run([*line, *overrides], capture_output=True, text=True, timeout=240, check=False)


@pytest.mark.parametrize(
    ("name", "setting", "own"),
    [
        ("sessile_drop", COARSE_DROP, {"height_error"}),
        ("bga_ball", COARSE_DROP, {"height_error", "contact_angle_error"}),
        ("solder_joint", COARSE_JOINT, {"waist", "waist_error", "axial_force", "axial_force_error"}),
    ],
)
def test_from_case_file_to_report(tmp_path, name, setting, own):
    result = run(name, tmp_path, setting)
    assert result.returncode == 0, result.stdout + result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert set(summary["metrics"]) >= ALWAYS | own
    assert all(check["ok"] for check in summary["health"].values())
    assert summary["metrics"]["verdict"]["value"] == "ok"
    assert set(summary["timings"]) == {"reflow"}
    assert "<svg" in (tmp_path / "report.html").read_text()
    assert not list(tmp_path.glob(".*.partial"))
    assert "nothing to do" in run(name, tmp_path, setting).stdout


def test_an_offset_joint_has_no_meridian(tmp_path):
    result = run("solder_joint", tmp_path, COARSE_JOINT, "joint.offset=0.07 mm")
    assert result.returncode == 0, result.stdout + result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert "max_width_error" not in summary["metrics"]
    assert "volume_drift" in summary["health"]


def test_a_drop_that_finds_no_rest_says_so(tmp_path):
    result = run("sessile_drop", tmp_path, COARSE_DROP, "solder.numerics.max_steps=2")
    assert result.returncode == 1
    assert "stage reflow failed: NoRest" in result.stderr
    assert not (tmp_path / "reflow").exists()
