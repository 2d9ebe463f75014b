"""Points of a small drop, computed through Snakemake: killed in the middle, one that fails, the same as a run."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import psutil

from tests.support.workflow_command import wait_until
from workflow.inputs import read_record
from workflow.points.batch import Machine, missing, run_points
from workflow.points.point import read_points
from workflow.points.store import Store
from workflow.stage_runner import Run, run_stage
from workflow.stages import STAGE_FUNCTIONS

CASE = Path(__file__).resolve().parents[2] / "cases" / "sessile_drop" / "case.toml"
COARSE = {"drop.particles_per_edge": "5"}
SETTINGS = [COARSE, COARSE | {"case.title": "shared"}, COARSE | {"solder.numerics.max_steps": "1"}]
TIMES = {"seconds", "particle_steps_per_second"}
PROGRAM = f"""
from pathlib import Path
from workflow.points.batch import Machine, run_points
from workflow.points.point import read_points
from workflow.points.store import Store
run_points(Store(Path("store")), read_points(Path({str(CASE)!r}), {SETTINGS!r}), "report", Machine(cores=2))
"""


def test_points_are_computed_once_and_survive_a_kill(tmp_path):
    store, points = Store(tmp_path / "store"), read_points(CASE, SETTINGS)
    assert len(missing(store, points, "report")) == 5
    process = subprocess.Popen([sys.executable, "-c", PROGRAM], cwd=tmp_path)
    reflow = store.stage_folder(points[0].case, "reflow") / "stage.json"
    wait_until(reflow.exists)
    children = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(signal.SIGKILL)
    assert psutil.wait_procs([psutil.Process(process.pid), *children], timeout=15)[1] == []
    kept = reflow.stat().st_mtime_ns
    failed = run_points(store, points, "report", Machine(cores=2))
    assert reflow.stat().st_mtime_ns == kept
    assert set(failed) == {points[2].key}
    assert failed[points[2].key].startswith("stage reflow: NoRest: ")
    assert missing(store, points[:2], "report") == []
    assert len(list((store.folder / "stages").iterdir())) == 1

    summary = json.loads((store.run_folder(points[1]) / "summary.json").read_text())
    run = Run(tmp_path / "run", points[0].case, cores=1)
    record = run_stage("reflow", STAGE_FUNCTIONS["drop"]["reflow"], run)
    found, expected = (
        {name: value for name, value in each["metrics"].items() if name not in TIMES} for each in (summary, record)
    )
    assert found == expected
    assert read_record(store.run_folder(points[1]), points[1].case.pipeline["reflow"])["health"] == record["health"]

    report = store.run_folder(points[1]) / "report.html"
    written = report.stat().st_mtime_ns
    assert run_points(store, points[:2], "report", Machine(cores=2)) == {}
    assert report.stat().st_mtime_ns == written
