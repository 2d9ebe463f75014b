"""Drops and joints from case file to report, shortened."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from reflowshock.particles.scenes.drop_at_rest import drop_to_rest
from reflowshock.particles.scenes.products import read_body
from reflowshock.particles.scenes.reflow import solve_joint
from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.solder.case import DropCase, JointCase
from reflowshock.workflow.stages import stage_function
from tests.support.warm_start import warm_command
from tests.support.workflow_command import break_off

CASES = Path(__file__).resolve().parents[2] / "cases"
COARSE_DROP, COARSE_JOINT = "drop.particles_per_edge=7", "joint.spacing=0.06 mm"
ALWAYS = {
    "height", "max_width", "volume_drift", "mean_pressure", "pressure_scatter",
    "capillary_number_at_rest", "time_step_over_capillary_limit", "particles", "particle_steps_per_second", "seconds",
    "max_width_error", "verdict",
}  # fmt: skip

CONTACT = {"contact_radius", "contact_angle"}


def command(name: str, folder: Path, *settings: str) -> list[str]:
    """Return the words of a command that runs a case of the checkout with settings."""
    line = [sys.executable, "-m", "reflowshock", "run", str(CASES / name / "case.toml"), "--out", str(folder)]
    return [*line, *(item for setting in settings for item in ("--set", setting))]


def run(name: str, folder: Path, *settings: str) -> subprocess.CompletedProcess:
    """Run a case of the checkout with settings to its end; return the completed process."""
    return warm_command(*command(name, folder, *settings)[3:])


@pytest.mark.parametrize(
    ("name", "setting", "metrics"),
    [
        ("sessile_drop", COARSE_DROP, CONTACT | {"height_error"}),
        pytest.param(
            "bga_ball", COARSE_DROP, CONTACT | {"height_error", "contact_angle_error"}, marks=pytest.mark.long
        ),
        pytest.param("laplace_drop", COARSE_DROP, {"height_error", "mean_pressure_error"}, marks=pytest.mark.long),
        ("solder_joint", COARSE_JOINT, CONTACT | {"waist", "waist_error", "axial_force", "axial_force_error"}),
    ],
)
def test_from_case_file_to_report(tmp_path, name, setting, metrics):
    result = run(name, tmp_path, setting)
    assert result.returncode == 0, result.stdout + result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert set(summary["metrics"]) >= ALWAYS | metrics
    assert all(check["ok"] for check in summary["health"].values())
    assert summary["metrics"]["verdict"]["value"] == "ok"
    assert set(summary["timings"]["wall"]) == {"reflow"}
    page = (tmp_path / "report.html").read_text()
    assert 'data-scene="0"' in page and 'data-figure="0"' in page
    assert not list(tmp_path.rglob("*.partial"))
    assert "nothing to do" in run(name, tmp_path, setting).stdout


@pytest.mark.long
def test_a_drop_in_a_plane_from_case_file_to_report(tmp_path):
    """A ridge with the liquid of the paper rests as a circular segment with the area of the cube's face."""
    settings = ("drop.section=plane", "drop.particles_per_edge=8", "drop.contact_angle=120 deg")
    result = run("sessile_drop", tmp_path, *settings, "solder.effects.inertia=on", "solder.parameters=paper")
    assert result.returncode == 0, result.stdout + result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    metrics = {name: metric["value"] for name, metric in summary["metrics"].items()}
    angle = np.radians(120.0)
    radius = 1e-3 / np.sqrt(angle - np.sin(angle) * np.cos(angle))
    assert metrics["height"] == pytest.approx(radius * (1.0 - np.cos(angle)), rel=3e-3)
    assert metrics["max_width"] == pytest.approx(2.0 * radius, rel=1e-3)
    assert metrics["volume"] == pytest.approx(1e-9, rel=1e-12)
    assert metrics["particles_lost"] == 0
    assert "distance from the centre [mm]" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize(
    "wall_settings",
    [pytest.param((), marks=pytest.mark.long), ("drops.contact_angle=60 deg", "drops.distance=1.3 mm")],
    ids=["free", "wall"],
)
def test_two_drops_from_case_file_to_report(tmp_path, wall_settings):
    result = run("coalescence", tmp_path, "drops.spacing=0.13 mm", "gravity=off", *wall_settings)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["metrics"]["drops_left"]["value"] == 1
    assert abs(summary["metrics"]["volume_drift"]["value"]) < 1e-6
    limits = {"height_error", "max_width_error"} | (set() if wall_settings else {"radius_error"})
    assert set(summary["health"]) >= limits | {"drops_not_as_meant", "volume_drift", "capillary_number_at_rest"}
    assert result.returncode == 0, result.stderr
    page = (tmp_path / "report.html").read_text()
    assert 'data-scene="0"' in page and 'data-figure="0"' in page


def test_an_oscillation_from_case_file_to_report(tmp_path):
    settings = ("oscillation.particles_per_radius=2", "oscillation.periods=1.5")
    result = run("oscillating_drop", tmp_path, *settings)
    summary = json.loads((tmp_path / "summary.json").read_text())
    metrics = {
        "period",
        "period_error",
        "decay_rate",
        "decay_rate_error",
        "volume_drift",
        "time_step_over_capillary_limit",
    }
    assert set(summary["metrics"]) >= metrics | {"particles", "particle_steps_per_second"}
    assert set(summary["health"]) == {"period_error", "decay_rate_error", "volume_drift"}
    assert result.returncode == (0 if all(check["ok"] for check in summary["health"].values()) else 1)
    page = (tmp_path / "report.html").read_text()
    assert 'data-scene="0"' in page and 'data-figure="0"' in page


MOVED = ("joint.spacing=0.07 mm", "solder.numerics.time_step_limit=100")


def reflow_here(folder: Path, *settings: str) -> Findings:
    """Run the reflow of the solder joint in this process and check its health."""
    case = read_case(CASES / "solder_joint" / "case.toml", settings)
    (folder / "reflow").mkdir()
    findings = stage_function(case, "reflow")(Run(folder, case, 1), folder / "reflow")
    assert all(check["ok"] for check in findings.health.values()), findings.health
    return findings


def test_a_package_floats_to_its_collapse_height_and_centres_itself(tmp_path):
    """A package offset by 0.3 radius under a load settles where the Young-Laplace force carries it."""
    findings = reflow_here(tmp_path, *MOVED, "joint.offset=0.072 mm", "joint.package.load=0.1 mN")
    assert findings.metrics["offset"]["value"] < 0.01 * 0.24e-3
    assert set(findings.health) >= {"collapse_height_error", "force_balance_error", "max_width_error"}


def test_a_package_is_moved_along_a_path(tmp_path):
    findings = reflow_here(tmp_path, *MOVED, "joint.path.standoff=0.42 mm", "joint.path.steps=2")
    places = json.loads((tmp_path / "reflow" / "path.json").read_text())
    assert [path_point["standoff"] for path_point in places] == pytest.approx([0.35e-3, 0.385e-3, 0.42e-3])
    pull = np.pi * 0.24e-3 * 0.4985
    for path_point in places:
        assert path_point["axial_force"] == pytest.approx(path_point["axial_force_exact"], abs=0.02 * pull)
    assert findings.metrics["places"]["value"] == 3


def test_an_offset_joint_has_no_meridian(tmp_path):
    findings = reflow_here(tmp_path, COARSE_JOINT, "joint.offset=0.07 mm")
    assert "max_width_error" not in findings.metrics
    assert "volume_drift" in findings.health


def short_steps(limit: float) -> tuple[str, str]:
    """Return settings with a time step so short that a run outlasts the interval of its checkpoints."""
    return f"solder.numerics.time_step_limit={limit}", "solder.numerics.max_steps=2000"


def rest_of_drop(case: DropCase) -> np.ndarray:
    """Return the particle positions of a drop at rest, shape (n, 3) [m]."""
    return drop_to_rest(case.drop, case.molten).shape.points


def rest_of_joint(case: JointCase) -> np.ndarray:
    """Return the particle positions of a joint at rest, shape (n, 3) [m]."""
    return solve_joint(case.joint.geometry, case.molten).points


@pytest.mark.parametrize(
    ("name", "settings", "at_rest", "end"),
    [
        pytest.param(
            "sessile_drop",
            ("drop.particles_per_edge=8", *short_steps(5)),
            rest_of_drop,
            signal.SIGKILL,
            marks=pytest.mark.long,
        ),
        pytest.param(
            "solder_joint",
            (COARSE_JOINT, *short_steps(1)),
            rest_of_joint,
            signal.SIGTERM,
            marks=pytest.mark.long,
        ),
    ],
)
def test_a_run_that_is_broken_off_continues_to_the_same_bits(tmp_path, name, settings, at_rest, end):
    """Killing the command also ends its child processes, and the run continues."""
    break_off(command(name, tmp_path, *settings), tmp_path, end, "command")
    result = run(name, tmp_path, *settings)
    assert result.returncode == 0, result.stderr
    assert "continued from checkpoints" in " ".join(result.stdout.split())
    assert not list((tmp_path / ".store/work").iterdir())
    expected = at_rest(read_case(CASES / name / "case.toml", settings))
    assert np.array_equal(read_body(tmp_path / "reflow")[0].points, expected)


def test_a_drop_that_finds_no_rest_says_so(tmp_path):
    result = run("sessile_drop", tmp_path, COARSE_DROP, "solder.numerics.max_steps=2")
    assert result.returncode == 1
    assert "stage reflow failed: no rest after 2 steps (solder.numerics.max_steps)" in result.stderr
    assert not (tmp_path / "reflow").exists()


@pytest.mark.parametrize(
    ("name", "metrics"),
    [
        pytest.param("young_laplace", {"mean_pressure", "roundness"}, marks=pytest.mark.long),
        pytest.param("static_caps", {"base_over_diameter", "height_over_diameter"}, marks=pytest.mark.long),
        ("drop_impact", {"spread_max", "time_of_spread_max"}),
    ],
)
def test_a_droplet_goes_from_case_file_to_report(tmp_path, name, metrics):
    short = ("droplet.duration=2 us", "droplet.numerics.particles_per_diameter=8", "scale=full")
    ended = run(name, tmp_path / "run", *short)
    assert "report: " in ended.stdout, ended.stderr
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert metrics | {"volume_drift", "particles", "particle_steps_per_second"} <= summary["metrics"].keys()
    assert {"droplet_tension", "droplet_gravity"} <= summary["effects"].keys()
    assert "<h2>Flow</h2>" in (tmp_path / "run/report.html").read_text()


def test_drops_are_printed_from_case_file_to_report(tmp_path):
    single_drop = ("printing.columns=1", "printing.rows=1", "printing.layers=1", "scale=full")
    ended = run("printing", tmp_path / "run", *single_drop)
    assert "report: " in ended.stdout, ended.stderr
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert {"drops", "volume_error", "connected_parts_max", "roughness_sa", "volume_drift"} <= summary["metrics"].keys()
    assert summary["metrics"]["outcome"]["value"] == "separate"
    page = (tmp_path / "run/report.html").read_text()
    assert "<h2>Printed part</h2>" in page and "Sa [µm]" in page and "6.37" in page and "mm³" not in page
    assert {"part.stl", "height_map.png"} <= {path.name for path in (tmp_path / "run/particles").iterdir()}


@pytest.mark.long
def test_a_drop_freezes_from_case_file_to_report(tmp_path):
    ended = run("frozen_drop", tmp_path / "run", "scale=quick")
    assert "report: " in ended.stdout, ended.stderr
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert {"solid_after", "footprint", "volume_error"} <= summary["metrics"].keys()
    assert summary["effects"]["freezing"]["on"]


@pytest.mark.parametrize(
    ("name", "settings", "metrics"),
    [
        ("dam_break", ("dam_break.duration=0.05 s",), {"particles_lost", "energy_rise"}),
        pytest.param(
            "poiseuille", ("poiseuille.duration=0.02",), {"profile_error_at_end", "reynolds"}, marks=pytest.mark.long
        ),
        pytest.param(
            "taylor_green", ("taylor_green.duration=0.1",), {"decay_rate_error", "speed_error"}, marks=pytest.mark.long
        ),
    ],
)
def test_a_flow_goes_from_case_file_to_report(tmp_path, name, settings, metrics):
    ended = run(name, tmp_path / "run", *settings, f"{name}.numerics.particles_across=10", "scale=full")
    assert "report: " in ended.stdout, ended.stderr
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert metrics | {"volume_drift", "particles", "particle_steps_per_second"} <= summary["metrics"].keys()
    assert summary["effects"].keys() == {
        "flow_viscosity",
        "artificial_viscosity",
        "shear_dependent_viscosity",
    }
    page = (tmp_path / "run/report.html").read_text()
    assert "<h2>Flow</h2>" in page
    assert (tmp_path / "run/particles/particles.vtu").exists()
