"""The command ``accuracy`` on a study with synthetic runs: error h^2, cost 2 s + h^-4 / 1000."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from reflowshock.workflow.accuracy import command
from reflowshock.workflow.accuracy.command import (
    AccuracyRequest,
    is_within_tolerance,
    measure,
    read_request,
    remark_unverified,
)
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.cli import main
from reflowshock.workflow.convergence.accuracy_file import StageCost, read_accuracy, this_host
from reflowshock.workflow.convergence.calibration import calibration_from_runs, calibration_from_study, default_folder
from reflowshock.workflow.convergence.page import section, section_for, write_pages
from reflowshock.workflow.convergence.solder import SCHEMES
from reflowshock.workflow.convergence.tables import as_lines, as_options, legend, on_front, runs
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.plan import predicted_costs
from reflowshock.workflow.store.store import MESSAGE, REPETITIONS, Store
from reflowshock.workflow.store.view import show
from tests.support.products import record_of

CASE = Path(__file__).resolve().parents[3] / "cases/sessile_drop/case.toml"
BROKEN = "the flow is unstable"


@dataclass
class Fake:
    """Synthetic solver that records which points it computes."""

    slow: float = 1.0
    drift: float = 0.0
    computed: list[tuple[str, str]] = field(default_factory=list)

    def __call__(self, store, points):
        failed = {}
        for point in points:
            self.computed.append((store.folder.name, point.key))
            if point.case.solder.numerics.scheme == "gripc":
                failed[point.key] = f"stage reflow: {BROKEN}"
                partial = store.work_folder(point, "reflow") / ".reflow.partial"
                partial.mkdir(parents=True)
                (partial / MESSAGE).write_text(BROKEN)
                continue
            record_of(store.product(point, "reflow"), **self.record(point.case.drop))
            show(store, point, ["reflow"])
        return failed

    def record(self, drop) -> dict:
        spacing = 1.0 / (drop.count - 1)
        seconds = self.slow * (2.0 + (0.3 if drop.symmetry == "quarter" else 1.0) * spacing**-4 / 1000.0)
        metrics = {"shape_error": {"value": spacing**2, "unit": ""}, "height_error": {"value": -spacing, "unit": ""}}
        health = {"volume_drift": {"value": self.drift, "limit": 1e-6, "ok": self.drift <= 1e-6}}
        times = {"seconds": 1.1 * seconds, "core_seconds": seconds}
        return times | {"metrics": metrics, "health": health, "continued": "", "inputs": {}}


def request(tolerance: float | None = 0.02, budget: float = float("inf"), **settings: str) -> AccuracyRequest:
    """Return the request of a convergence study with tolerance and budget."""
    return AccuracyRequest(CASE, settings, tolerance, budget, "reflowshock accuracy")


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Return study, runner, synthetic runs and folder of a finished study."""
    folder = tmp_path_factory.mktemp("runs") / "sessile_drop-accuracy"
    compute = Fake()
    accuracy, runner = measure(request(0.002), folder, compute)
    return accuracy, runner, compute, folder


def test_orders_and_costs_are_fitted(done):
    accuracy = done[0]
    spacing = accuracy.fits["particle spacing"]
    assert spacing.errors["shape_error"].order == pytest.approx(2.0)
    assert spacing.errors["height_error"].order == pytest.approx(1.0)
    assert (spacing.cost.start, spacing.cost.exponent) == pytest.approx((2.0, 4.0), rel=0.01)


def test_recommendation_lies_between_measured_points_and_is_run(done):
    accuracy = done[0]
    chosen = accuracy.recommended
    assert chosen.run.settings == {"drop.particles_per_edge": "25", "drop.symmetry": "quarter"}
    assert 24**-2 < 0.002 < 22**-2
    assert chosen.found.errors["shape_error"].value == pytest.approx(chosen.error)
    assert chosen.found.core_seconds == pytest.approx(chosen.core_seconds, rel=0.02)
    assert is_within_tolerance(accuracy)


def test_second_call_computes_nothing_and_another_tolerance_only_new_points(done):
    accuracy, _, compute, folder = done
    before = len(compute.computed)
    repeated, _ = measure(request(0.002), folder, compute)
    assert len(compute.computed) == before and repeated == accuracy
    other, _ = measure(request(0.004), folder, compute)
    fresh = [key for store, key in compute.computed[before:] if store == folder.name]
    assert fresh == [other.recommended.found.key]
    measure(request(0.002), folder, compute)


def test_cheap_points_are_repeated_and_the_smallest_time_counts(done):
    _, runner, compute, folder = done
    repeated = [key for store, key in compute.computed if store != folder.name]
    assert repeated.count(runner.points["6 per edge"].key) == REPETITIONS
    assert runner.points["27 per edge"].key not in repeated


def test_failed_run_is_a_row_with_its_message(done):
    accuracy = done[0]
    rows = {row[0].removesuffix(" *"): row for row in runs(accuracy)["rows"]}
    assert rows["gripc, linear"][-1] == f"failed: stage reflow: {BROKEN}"
    assert rows["21 per edge"][-1] == "" and "compared with exact: Young-Laplace" in legend(accuracy)
    assert rows["21 per edge"][1:3] == ["0.25 %", "5 %"]


def test_pareto_front_has_the_cheapest_and_the_most_accurate_run(done):
    best = on_front(done[0])
    assert "6 per edge" in best and "27 per edge, quarter" in best and "27 per edge" not in best


def test_page_has_settings_failures_remarks_and_plots(done, tmp_path):
    accuracy = done[0]
    write_pages(tmp_path, accuracy, ("A remark.",))
    page = (tmp_path / "accuracy.html").read_text()
    assert 'data-figure="0"' in page
    for text in ("particles_per_edge = 25", "25 per edge, quarter", BROKEN, "A remark.", "Pareto front"):
        assert text in page
    assert (tmp_path / "accuracy.png").stat().st_size > 10_000
    assert "| 21 per edge |" in (tmp_path / "accuracy.md").read_text()


def test_report_uses_the_study_next_to_its_run_folder(done):
    folder = done[3]
    case = read_case(CASE)
    context = section_for(folder.parent / "sessile_drop", case)
    assert context["case"] == "sessile_drop"
    assert context["runs"] == section(read_accuracy(folder / "accuracy.json"))["runs"]


def test_runs_that_exceed_the_budget_are_left_out(tmp_path):
    compute = Fake()
    accuracy, runner = measure(request(None, 30.0), tmp_path, compute)
    assert {m.run for m in accuracy.measurements if m.stages}.isdisjoint(runner.left_out)
    assert "27 per edge" in runner.left_out and "6 per edge" not in runner.left_out
    assert accuracy.recommended.core_seconds <= 30.0 and "within the budget" in accuracy.recommended.why
    nothing, _ = measure(request(0.02, 0.1), tmp_path / "short", compute)
    assert not nothing.measurements and nothing.recommended is None and not is_within_tolerance(nothing)


def test_long_runs_are_left_out_without_a_budget(tmp_path, monkeypatch):
    monkeypatch.setattr(command, "LONGEST", 20.0)
    accuracy, runner = measure(request(), tmp_path, Fake())
    assert "27 per edge" in runner.left_out and "11 per edge" not in runner.left_out
    coarsest = {run.name for parameter in runner.study.parameters for run in parameter.runs[:4]}
    assert coarsest.isdisjoint(runner.left_out)
    (remark,) = command._left_out(runner)
    assert "more than 20 s" in remark and "--budget" in remark
    assert accuracy.recommended.found is not None


def test_continued_run_is_timed_again(tmp_path):
    compute = Fake()

    def interrupted(store, points):
        failed = compute(store, points)
        if store.folder == tmp_path:
            for point in points:
                record = store.record(point, "reflow")
                if record is not None:
                    record_of(store.product(point, "reflow"), **record | {"continued": "the drop", "core_seconds": 9.9})
        return failed

    accuracy, _ = measure(request(), tmp_path, interrupted)
    costs = {m.run: m.core_seconds for m in accuracy.measurements}
    assert costs["27 per edge"] == pytest.approx(2.0 + 26**4 / 1000.0)


def test_forecasts_are_corrected_by_the_nearest_measured_run():
    pairs = [{"reflow": StageCost(4.0, 4.0, 2.0)}, {"reflow": StageCost(100.0, 100.0, 20.0)}, {}]
    correction = calibration_from_runs(pairs)
    assert correction.points == 2
    assert [correction.corrected("reflow", predicted) for predicted in (3.0, 15.0)] == pytest.approx([6.0, 75.0])
    assert correction.corrected("shock", 3.0) == 3.0 and not correction.covers("shock")


def test_plan_names_the_study_that_corrected_a_cost(done, monkeypatch):
    case = read_case(CASE)
    monkeypatch.chdir(done[3].parents[1])
    nowhere = Store(Path("nowhere"), one_run=True)
    assert str(predicted_costs(nowhere, case, {"reflow": 3.0})["reflow"]) == "about 3 s"
    default_folder(case).parent.mkdir(exist_ok=True)
    default_folder(case).symlink_to(done[3])
    correction = calibration_from_study(case)
    expected = correction.corrected("reflow", 3.0)
    assert expected != 3.0
    cost = str(predicted_costs(nowhere, case, {"reflow": 3.0})["reflow"])
    assert cost.endswith(f"s (measured: accuracy, {correction.points} points)")


def test_plan_is_corrected_by_earlier_runs_in_its_folder(tmp_path):
    store, case = Store(tmp_path, one_run=True), read_case(CASE)
    record = {"machine": str(this_host()), "forecast": 2.0, "seconds": 5.0}
    record_of(tmp_path / ".store/products/reflow-1", **record)
    record_of(tmp_path / ".store/products/reflow-2", **record | {"continued": "from 50 %", "seconds": 1.0})
    record_of(tmp_path / ".store/products/reflow-3", **record | {"machine": "another", "seconds": 1.0})
    costs = predicted_costs(store, case, {"reflow": 4.0, "surface": 1.0})
    assert str(costs["reflow"]) == "about 10 s*"
    assert str(costs["surface"]) == "about 1 s"


def test_recommendation_that_was_not_run_has_a_remark(done):
    accuracy = done[0]
    assert remark_unverified(accuracy) == []
    (remark,) = remark_unverified(replace(accuracy, recommended=replace(accuracy.recommended, found=None)))
    assert "was not run (it exceeds the remaining budget)" in remark and "predicted, not measured" in remark


def test_settings_are_lines_of_a_case_file_and_options():
    settings = {"drop.particles_per_edge": "24", "solder.numerics.time_step_limit": "20", "drop.volume": "1 mm^3"}
    assert as_lines(settings) == [
        "[drop]", "particles_per_edge = 24", 'volume = "1 mm^3"', "[solder.numerics]", "time_step_limit = 20",
    ]  # fmt: skip
    assert "--set 'drop.volume=1 mm^3'" in as_options(settings)


def test_failed_checks_and_runs_are_reported(tmp_path, monkeypatch, capsys):
    compute = Fake(drift=1e-3)
    monkeypatch.setattr(command, "_compute", lambda store, points, **_: compute(store, points))
    monkeypatch.setattr("sys.argv", ["reflowshock", "accuracy", str(CASE), "--out", str(tmp_path)])
    with pytest.raises(SystemExit):
        main()
    output = capsys.readouterr().out
    assert "Failed checks of 7 per edge: reflow: volume drift" in output
    work = tmp_path / ".store/work"
    assert f"Failed runs are not repeated unless you remove {work}." in output.replace("\n", "")


@pytest.mark.parametrize(("tolerance", "code"), [pytest.param("0.2%", 0, marks=pytest.mark.long), ("0.0001%", 1)])
def test_command_prints_at_most_a_hundred_columns(tmp_path, monkeypatch, capsys, tolerance, code):
    compute = Fake()
    monkeypatch.setattr(command, "_compute", lambda store, points, **_: compute(store, points))
    line = ["reflowshock", "accuracy", str(CASE), "--tolerance", tolerance, "--out", str(tmp_path)]
    monkeypatch.setattr("sys.argv", line)
    with pytest.raises(SystemExit) as ended:
        main()
    output = capsys.readouterr().out
    assert ended.value.code == code
    assert "Recommended: " in output and "--set drop.particles_per_edge=" in output
    table = [line for line in output.splitlines() if "per edge" in line and "│" in line]
    assert len(table) > 10 and max(map(len, table)) <= 100


@pytest.mark.parametrize(
    ("tolerance", "budget", "key"),
    [("two", None, "--tolerance"), ("120%", None, "--tolerance"), ("2% or so", None, "--tolerance"),
     (None, "10 mm", "--budget"), (None, "10", "--budget"), (None, "-3 s", "--budget")],
)  # fmt: skip
def test_invalid_tolerance_or_budget_is_rejected(tolerance, budget, key):
    with pytest.raises(CaseError, match=key):
        read_request(CASE, [], tolerance, budget)


def test_request_is_read_from_options():
    read = read_request(CASE, ["gravity=on"], "2%", "10min")
    assert (read.tolerance, read.budget, read.settings) == (0.02, 600.0, {"gravity": "on"})
    assert "--tolerance 2% --budget 10min --set gravity=on" in read.command
    assert read_request(CASE, [], None, None).tolerance == 0.02
    assert read_request(CASE, [], None, "1 h").tolerance is None


@pytest.mark.parametrize(
    "name", ["sessile_drop", "bga_ball", "laplace_drop", "solder_joint", "coalescence", "oscillating_drop"]
)
def test_every_run_of_solder_alone_is_a_valid_case(name):
    path = CASE.parents[1] / name / "case.toml"
    case = read_case(path)
    study = kind_of(case).study(case)
    for run in study.runs:
        if not run.name.endswith(tuple(SCHEMES)):  # some drops do not support them: test_accuracy_series
            read_case(path, [f"{key}={value}" for key, value in run.settings.items()])
    for parameter in study.parameters:
        sizes = [run.value for run in parameter.runs]
        assert sizes == sorted(sizes, reverse=True)
        assert parameter.run_at(0.97 * sizes[1]).value <= 0.97 * sizes[1] * (1 + 1e-6)
