"""A stage's folder appears complete, or not at all; a run folder has one user at a time."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.workflow_command import SMALL_CASE
from workflow.case import read_case
from workflow.check_text import against_limit
from workflow.pipeline import RunFolderBusy, failed_checks, locked
from workflow.problems import CaseError
from workflow.stage_runner import Findings, Run, execute, run_stage


@pytest.fixture
def run(tmp_path):
    return Run(tmp_path, read_case(SMALL_CASE), cores=1)


def write_surfaces(_run: Run, folder: Path) -> Findings:
    (folder / "surfaces.json").write_text("{}")
    return Findings(
        metrics={"volume": {"value": 1.0, "unit": "m^3"}},
        health={"volume_error": {"value": 0.2, "limit": 0.1, "ok": False}},
    )


def fail(_run: Run, folder: Path) -> Findings:
    (folder / "surfaces.json").write_text("half")
    raise ValueError("no surface")


def test_a_stage_leaves_products_and_a_record(run):
    record = run_stage("surface", write_surfaces, run)
    written = json.loads((run.folder / "surface/stage.json").read_text())
    assert written == record
    assert written["metrics"]["volume"] == {"value": 1.0, "unit": "m^3"}
    assert written["seconds"] >= 0.0
    assert sorted(path.name for path in run.folder.iterdir()) == ["surface"]


def test_processor_time_of_programs_that_a_stage_starts_is_counted(run):
    busy = "import time\nwhile time.process_time() < 0.2: pass"

    def start(_run: Run, _folder: Path) -> Findings:
        subprocess.run([sys.executable, "-c", busy], check=True)
        return Findings()

    assert run_stage("surface", start, run)["core_seconds"] >= 0.2


def test_a_failed_stage_leaves_no_product(run):
    with pytest.raises(ValueError, match="no surface"):
        run_stage("surface", fail, run)
    assert not (run.folder / "surface").exists()


def test_a_rerun_replaces_all_of_a_product(run):
    run_stage("surface", write_surfaces, run)
    (run.folder / "surface/old.vtu").write_text("old")
    (run.folder / ".surface.partial").mkdir()
    run_stage("surface", write_surfaces, run)
    assert not (run.folder / "surface/old.vtu").exists()


def test_a_check_that_failed_is_named(run):
    run_stage("surface", write_surfaces, run)
    assert failed_checks(run.folder, run.case.pipeline.upstream("report")) == ["surface: volume error 0.2, limit 0.1"]
    assert failed_checks(run.folder, run.case.pipeline.upstream("reflow")) == []


def test_a_run_folder_has_one_user(tmp_path):
    with locked(tmp_path), pytest.raises(RunFolderBusy, match="another run is at work"), locked(tmp_path):
        pass
    with locked(tmp_path):
        pass


def test_an_interrupt_that_compiled_code_wraps_is_one(run):
    def interrupted(_run: Run, _folder: Path):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    with pytest.raises(KeyboardInterrupt):
        execute("surface", interrupted, run)


def test_a_file_is_no_run_folder(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(CaseError, match="cannot be a run folder"), locked(tmp_path / "file"):
        pass


def test_checks_of_quantities_have_their_unit():
    assert against_limit("dns_peel_stress", {"value": 5.2e6, "limit": 1e6}) == ("5.2 MPa", "1 MPa")
    assert against_limit("frequency_1_high", {"value": 273.47, "limit": 350.0}) == ("273.5 Hz", "350 Hz")
    assert against_limit("swing_frequency_error", {"value": 0.004, "limit": 0.02}) == ("0.004", "0.02")
