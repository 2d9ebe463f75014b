"""A shortened case from case file to report, then rerun, changed and interrupted."""

import json
import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import psutil
import pytest

from reflowshock.particles.scenes.products import read_shapes
from reflowshock.workflow.package.case import BOARD_DROP
from tests.support.workflow_command import SMALL_CASE, break_off, command_line, reflowshock, times, wait_until

NAMES = BOARD_DROP.names
SNAKEFILE = Path(__file__).resolve().parents[2] / "workflow" / "Snakefile"


def planned(text: str) -> set[str]:
    """Return the stages that ``plan`` will run."""
    rows = [line.split("│") for line in text.splitlines() if line.count("│") == 3]
    return {row[0].strip() for row in rows if row[1].strip() == "run"}


def work(folder: Path, stage: str) -> Path | None:
    """Return the work folder of a running stage, or None."""
    return next(iter(folder.glob(f".store/work/{stage}-*/.{stage}.partial")), None)


def start(folder: Path, *settings: str) -> subprocess.Popen:
    """Start a run of the shortened case; return its process."""
    line = command_line("run", folder, settings=settings)
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def test_the_whole_path(first_run):
    folder, result = first_run
    assert result.returncode == 0, result.stdout + result.stderr
    for stage in BOARD_DROP.stages:
        assert all((folder / product).stat().st_size for product in (*stage.products, stage.record))
    assert not list(folder.rglob("*.partial"))
    assert [name for name in NAMES if name in result.stdout] == list(NAMES)


def test_the_summary_has_what_scripts_read(first_run):
    summary = json.loads((first_run[0] / "summary.json").read_text())
    metrics = {name: metric["value"] for name, metric in summary["metrics"].items()}
    assert metrics["joint_count"] == 4
    assert metrics["joint_volume_error_max"] <= 0.003
    assert metrics["joint_width_error_max"] <= 0.01
    assert metrics["energy_balance_error"] <= 0.02
    assert metrics["interface_force_residual"] <= 1e-10
    assert metrics["critical_joint"] in {"A3", "A4", "B3", "B4"}
    assert set(metrics) >= {
        "critical_joint_stress_error", "two_scale_dns_core_ratio", "peak_board_strain", "peak_von_mises",
        "peak_acceleration@edge", "second_peak_acceleration@edge", "peak_displacement@edge", "peak_strain@corner",
        "peak_strain_rate@corner", "response_at_first_frequency",
    }  # fmt: skip
    assert 1e3 < metrics["first_frequency"] < 1e4
    assert all(check["ok"] for check in summary["health"].values())
    wall, predicted = (summary["timings"][name] for name in ("wall", "predicted"))
    assert set(wall) == set(predicted) == set(NAMES) - {"report"}
    assert len(summary["inputs_sha256"]) == 64


def processor_seconds() -> float:
    """Return the processor seconds of all child processes."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_the_second_run_does_nothing(run_folder):
    before, used = times(run_folder), processor_seconds()
    result = subprocess.run(command_line("run", run_folder), capture_output=True, text=True, check=False)
    assert result.returncode == 0
    assert "nothing to do" in result.stdout
    assert processor_seconds() - used < 5.0
    assert times(run_folder) == before


def test_plan_says_which_value_changed_and_what_reruns(first_run):
    result = reflowshock("plan", first_run[0], settings=("shock.peak_acceleration=1000 G",))
    assert result.returncode == 0, result.stderr
    assert "shock.peak_acceleration: 1500 G -> 1000 G" in result.stdout
    assert planned(result.stdout) == {"shock", "report"}


@pytest.mark.parametrize(
    "setting",
    [
        pytest.param("shock.pulse_duration=0.01 ms", marks=pytest.mark.long),
        pytest.param("package.joint_numerics.layers=5", marks=pytest.mark.long),
        pytest.param("board.thickness=1.1 mm", marks=pytest.mark.long),
        "solder.gravity=0 m/s^2",
    ],
)
def test_plain_snakemake_agrees_with_plan(run_folder, setting):
    planned_jobs = planned(reflowshock("plan", run_folder, settings=(setting,)).stdout)
    result = subprocess.run(
        [
            sys.executable, "-m", "snakemake", "-n", "-s", str(SNAKEFILE), "--config", f"case={SMALL_CASE}",
            f"out={run_folder}", f'set=["{setting}"]',
        ],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    words = [line.split() for line in (result.stdout + result.stderr).splitlines()]
    rules = {line[1].rstrip(":") for line in words if len(line) == 2 and line[0] in ("rule", "localrule")}
    assert rules - {"all"} == planned_jobs


def test_a_stage_that_is_broken_off_leaves_nothing_and_is_redone(run_folder):
    before = times(run_folder)
    process = start(run_folder, "solder.gravity=0 m/s^2")
    wait_until(lambda: work(run_folder, "reflow") is not None)
    children = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 1
    assert b"interrupted" in errors
    _, alive = psutil.wait_procs(children, timeout=15)
    assert alive == []
    assert not (run_folder / BOARD_DROP["reflow"].record).exists()
    result = reflowshock("run", run_folder, "--until", "reflow", settings=("solder.gravity=0 m/s^2",))
    assert result.returncode == 0, result.stderr
    after = times(run_folder)
    assert after["geometry"] == before["geometry"]
    assert after["reflow"] > before["reflow"]
    assert "shock" not in after and not (run_folder / "report.html").exists()


@pytest.mark.parametrize(
    ("end", "whom"), [pytest.param(signal.SIGTERM, "command", marks=pytest.mark.long), (signal.SIGKILL, "stage")]
)
def test_a_reflow_that_is_broken_off_continues_to_the_same_bits(first_run, tmp_path, end, whom):
    folder = tmp_path / "small"
    break_off(command_line("run", folder), folder, end, whom)
    assert set(times(folder)) == {"geometry"}
    result = reflowshock("run", folder, "--until", "reflow")
    assert result.returncode == 0, result.stderr
    assert "continued from checkpoints" in result.stdout
    assert not list((folder / ".store/work").iterdir())
    expected, actual = (read_shapes(run / "reflow/shapes.h5") for run in (first_run[0], folder))
    assert actual.keys() == expected.keys()
    for name, shape in expected.items():
        assert np.array_equal(actual[name].points, shape.points)
        assert np.array_equal(actual[name].history["energy"], shape.history["energy"])


@pytest.mark.long
def test_a_killed_stage_leaves_nothing(run_folder):
    process = start(run_folder, "shock.peak_acceleration=1000 G")
    wait_until(
        lambda: (
            (work_folder := work(run_folder, "shock")) is not None and (work_folder / "two_scale/input.json").exists()
        )
    )
    stages = [child for child in psutil.Process(process.pid).children(recursive=True) if "stage" in child.cmdline()]
    for stage in stages:
        os.kill(stage.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    assert process.returncode == 1
    assert not (run_folder / BOARD_DROP["shock"].record).exists()
    assert (run_folder / BOARD_DROP["solder_mesh"].record).exists()


def test_a_failure_names_stage_and_joint(tmp_path):
    result = reflowshock("run", tmp_path, "--until", "reflow", settings=("solder.numerics.max_steps=1",))
    assert result.returncode == 1
    assert "stage reflow failed" in result.stderr
    assert "joint " in result.stderr
    assert not (tmp_path / "reflow").exists()
    assert (tmp_path / "geometry").exists()


@pytest.mark.parametrize("command", ["run", "plan", "status"])
def test_bad_input_is_refused_before_anything_runs(tmp_path, command):
    result = reflowshock(command, tmp_path / "run", settings=("package.standoff=-1 mm",))
    assert result.returncode == 2
    assert 'package.standoff = "-1 mm"' in result.stderr
    assert not (tmp_path / "run").exists()
