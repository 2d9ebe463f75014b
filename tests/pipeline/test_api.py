"""Python interface of the program, on the folder of the shortened run."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import reflowshock
from tests.support.workflow_command import SMALL_CASE, times

JOINTS = ["A3", "A4", "B3", "B4"]


@pytest.fixture
def run(first_run) -> reflowshock.Run:
    """Return the run of the shortened case as an object of the Python interface."""
    return reflowshock.Run.open(first_run[0])


def test_metrics_are_those_of_the_summary(run):
    summary = json.loads((run.folder / "summary.json").read_text())
    assert run.is_healthy == all(check["ok"] for check in summary["health"].values())
    assert {name: {"value": value, "unit": unit} for name, (value, unit) in run.metrics.items()} == summary["metrics"]


def test_joints_are_a_table(run):
    joints = run.joints
    assert list(joints.index) == JOINTS
    assert joints.loc["A4", "verdict"] == "ok"
    assert joints["volume"].to_numpy() == pytest.approx(0.0724e-9, rel=5e-3)
    assert joints["standoff"].between(0.25e-3, 0.40e-3).all()


def test_history_of_each_mode(run):
    assert set(run.history) == {path.parent.name for path in run.folder.glob("shock/*/history.npz")}
    for history in run.history.values():
        assert history["time"][-1] == pytest.approx(0.03e-3, rel=0.02)
        assert history["von_mises_board"].shape == (len(history["time"]), len(history["joints"]))


def test_surface_of_a_joint(run):
    surface = run.surface("A4")
    assert surface.volume == pytest.approx(run.joints.loc["A4", "volume"], rel=1e-6)
    assert set(np.unique(surface["boundary"])) == {0, 1, 2}


def test_unknown_joint_is_told_the_nearest(run):
    with pytest.raises(reflowshock.UnknownName, match="no surface of a joint 'a4'; did you mean A4"):
        run.surface("a4")


def test_unknown_folder_is_told_the_nearest(run):
    with pytest.raises(reflowshock.UnknownName, match="smal is not a run folder; did you mean small"):
        reflowshock.Run.open(run.folder.parent / "smal")


def test_plan_and_run_of_what_is_there(run_folder):
    case = reflowshock.Case.load(SMALL_CASE)
    plan = case.plan(run_folder)
    assert not any(stage.runs for stage in plan.stages.values())
    assert plan.seconds == 0.0
    assert "up to date" in str(plan)
    before = (run_folder / "summary.json").stat().st_mtime_ns
    assert case.run(run_folder).metrics == reflowshock.Run.open(run_folder).metrics
    assert (run_folder / "summary.json").stat().st_mtime_ns == before
    changed = reflowshock.Case.load(SMALL_CASE, {"shock.duration": "0.02 ms"}).plan(run_folder)
    assert [name for name, stage in changed.stages.items() if stage.runs] == ["shock", "report"]
    assert "shock.duration: 0.03 ms -> 0.02 ms" in changed.stages["shock"].why


def test_a_change_runs_what_depends_on_it_beside_modules_of_a_users_own(run_folder, tmp_path, monkeypatch):
    """Files of the user with names of the program's modules are not imported."""
    before = times(run_folder)
    for name in ("workflow", "fem", "meshing", "particles", "cases", "api"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a module of the user was imported')\n")
    shutil.copy(SMALL_CASE, tmp_path / "small.toml")
    monkeypatch.chdir(tmp_path)
    shorter = {"shock.duration": "0.02 ms", "shock.ranks.total": 1, "shock.numerics.modes": ["two_scale"]}
    case = reflowshock.Case.load(Path("small.toml"), shorter)
    assert case.run(run_folder, force=True).history
    assert {name for name, time in times(run_folder).items() if time != before[name]} == {"shock", "report"}


def test_a_run_that_fails_says_why(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(reflowshock.RunFailed, match="contains files that the program did not write"):
        reflowshock.Case.load(SMALL_CASE).run(tmp_path / "mine")


def test_a_run_its_metrics_and_its_report_show_themselves(run):
    html = run._repr_html_()
    assert run.summary["answer"] in html and "data:image/png;base64," in html
    assert "<td>critical joint</td>" in run.metrics._repr_html_()
    frame = run.report._repr_html_()
    assert frame.startswith("<iframe") and 'sandbox="allow-scripts"' in frame and frame.count("<") == 2
