"""Study of a small drop through Snakemake: killed in the middle; one point fails, the others equal single runs."""

import csv
import json
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from reflowshock.workflow.case.run import Run
from reflowshock.workflow.jobs.batch import Machine, list_missing, run_points
from reflowshock.workflow.pipeline.stage_runner import run_stage
from reflowshock.workflow.stages import stage_function
from reflowshock.workflow.store.folders import lock_folder
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.study.command import read_points_of, run_study
from tests.support.warm_start import warm_python
from tests.support.workflow_command import wait_until

CASE = Path(__file__).resolve().parents[2] / "cases" / "sessile_drop" / "case.toml"
STUDY = f"""
study = {{ name = "drops", case = "{CASE}", rank_by = "height" }}
settings.drop.particles_per_edge = 5
grid."solder.numerics.max_steps" = [20000, 1]
"""
TIMES = {"seconds", "particle_steps_per_second"}


def untimed(record: dict) -> dict:
    """Return the metrics in a record without timings."""
    return {name: value for name, value in record["metrics"].items() if name not in TIMES}


def test_a_study_is_computed_once_and_survives_a_kill(tmp_path, monkeypatch):
    path, store = tmp_path / "study.toml", Store(tmp_path / "store")
    path.write_text(STUDY)
    study = read_points_of(path)
    good, bad = study.possible.values()
    process = subprocess.Popen([sys.executable, "-m", "reflowshock", "study", str(path), "--out", str(store.folder)])
    reflow = store.product(good, "reflow") / "stage.json"
    wait_until(reflow.exists)
    children = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(signal.SIGKILL)
    assert psutil.wait_procs([process, *children], timeout=60)[1] == []

    monkeypatch.setattr(sys, "executable", warm_python())
    modified = reflow.stat().st_mtime_ns
    assert not run_study(study, store, Machine(cores=2))
    assert reflow.stat().st_mtime_ns == modified
    with (store.folder / "results.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert [line["result"] for line in lines] == ["healthy", "failed"]
    assert lines[1]["message"].startswith("stage reflow: ")
    assert float(lines[0]["height [m]"]) == pytest.approx(5.8e-4, rel=0.01)
    assert [job.stage for job in list_missing(store, [good, bad], "report")] == ["reflow", "report"]

    summary = json.loads((store.run_folder(good) / "summary.json").read_text())
    stage, run = stage_function(good.case, "reflow"), Run(tmp_path / "run", good.case, cores=1)
    record = run_stage("reflow", stage, run, tmp_path / store.product(good, "reflow").name)
    assert untimed(summary) == untimed(record)
    stored = store.record(good, "reflow")
    assert stored is not None
    assert stored["health"] == record["health"]

    written = (store.run_folder(good) / "report.html").stat().st_mtime_ns
    with lock_folder(store.folder, "study", "drops") as lock:
        assert run_points(store, [good], "report", Machine(cores=2), lock) == {}
    assert (store.run_folder(good) / "report.html").stat().st_mtime_ns == written
    path.write_text(STUDY.replace("20000, ", "20000, 10000, "))
    more = list(read_points_of(path).possible.values())
    assert [job.point.settings for job in list_missing(store, more[:2], "report")] == 2 * [more[1].settings]
