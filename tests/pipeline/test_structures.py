"""Structures from case file to report, shortened."""

import json
import subprocess
from pathlib import Path

import pytest

from tests.support.warm_start import warm_command

CASES = Path(__file__).resolve().parents[2] / "cases"
COARSE_BOARD = (
    "scale=linear",
    "structure.cells=[12,8]", "dynamics.duration=0.5 ms", "dynamics.modes=3", "dynamics.numerics.field_samples=4",
    "dynamics.numerics.implicit_step=2.5 us",
)  # fmt: skip
SHORT = {
    "bar_wave": ("structure.layers.lower.cells=150", "structure.layers.upper.cells=90"),
    "cantilever": ("structure.layers.strip.thickness=1 mm", "dynamics.duration=7 ms"),
}
ERRORS = {
    "bar_wave": {"wave_speed_error", "transmitted_velocity_error", "reflected_velocity_error"},
    "cantilever": {"tip_deflection_error", "swing_frequency_error"},
}


def command(what: str, name: str, folder: Path, *settings: str, until: str = "") -> subprocess.CompletedProcess:
    """Run a command on a case of the checkout with settings; return the completed process."""
    line = [what, str(CASES / name / "case.toml"), "--out", str(folder)]
    line += ["--until", until] if until else []
    line += [item for setting in settings for item in ("--set", setting)]
    return warm_command(*line)


def test_both_solvers_of_a_board_from_case_file_to_report(tmp_path):
    result = command("run", "jedec_board", tmp_path, *COARSE_BOARD)
    assert result.returncode == 0, result.stdout + result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert set(summary["timings"]["wall"]) == {"geometry", "shock", "comparison", "errors"}
    assert set(summary["health"]) >= {
        "energy_balance_error", "implicit_energy_balance_error", "displacement_difference", "strain_difference",
        "frequency_1_low", "frequency_1_high",
    }  # fmt: skip
    assert summary["metrics"]["peak_strain@centre"]["value"] > 0.0
    assert 0.0 < summary["errors"]["peak_displacement@centre"]["discretisation"] < 1.0
    assert summary["errors"]["first_frequency"]["two_scale"] is None
    assert all(effect["why"] for effect in summary["effects"].values())
    page = (tmp_path / "report.html").read_text()
    assert page.count("data-figure=") >= 4 and page.count("data-scene=") == 2 and page.count("data:image/png") == 1
    assert "Fuchs" in page and "Natural modes" in page
    assert "nothing to do" in command("run", "jedec_board", tmp_path, *COARSE_BOARD).stdout
    plan = command("plan", "jedec_board", tmp_path, *COARSE_BOARD, "references.first_mode.at_most=300 Hz").stdout
    assert "references.first_mode.at_most: 350 Hz -> 300 Hz" in plan


@pytest.mark.parametrize("name", ["cantilever", pytest.param("bar_wave", marks=pytest.mark.long)])
def test_motion_against_its_exact_solution(name, tmp_path):
    result = command("run", name, tmp_path, *SHORT[name], until="comparison")
    assert result.returncode == 0, result.stdout + result.stderr
    health = json.loads((tmp_path / "comparison" / "stage.json").read_text())["health"]
    assert set(health) == ERRORS[name]


SMALL_BAR = (
    "structure.cells=[2,2]", "structure.length=1 mm", "structure.width=1 mm", "structure.layers.section.in_plane=[3,3]",
)  # fmt: skip


def test_two_scales_of_a_bar_from_case_file_to_report(tmp_path):
    """The case with a narrower bar, whose waves are plane."""
    result = command("run", "two_scale_bar", tmp_path, *SMALL_BAR)
    assert result.returncode == 0, result.stdout + result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    errors = {"wave_speed_error", "transmitted_velocity_error", "reflected_velocity_error"}
    assert set(summary["health"]) >= errors | {f"dns_{name}" for name in errors} | {"two_scale_displacement_error"}
    assert summary["metrics"]["two_scale_dns_time_ratio"]["value"] > 0.0
    assert summary["metrics"]["two_scale_dns_core_ratio"]["value"] > 0.0
    result = json.loads((tmp_path / "shock" / "explicit" / "result.json").read_text())
    assert result["coupling"]["scheme"] == "local_steps" and result["model"]["substeps"] > 4
    page = (tmp_path / "report.html").read_text()
    phrases = ("Two scales", "LTS-leapfrog", "Levels of time steps", "fine layers", "two-way")
    assert all(words in page for words in phrases)
    plan = command("plan", "two_scale_bar", tmp_path, *SMALL_BAR).stdout
    assert "two models" in plan and "fine layers: section" in " ".join(plan.split())


def test_bad_input_is_refused_before_anything_is_computed(tmp_path):
    result = command("run", "bar_wave", tmp_path, "references.wave.transmitted=beyon", "loads.push.on=z_mid")
    assert result.returncode == 2
    assert "references.wave.transmitted" in result.stderr and "did you mean beyond?" in result.stderr
    assert "loads.push.on" in result.stderr and "did you mean z_min?" in result.stderr
    assert not (tmp_path / "geometry").exists()
