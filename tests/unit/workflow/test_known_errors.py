"""Discretisation errors of headline figures, from the convergence study of the same inputs."""

from dataclasses import replace

import pytest

from reflowshock.fem.problem.shock import Shock
from reflowshock.workflow.convergence.accuracy_file import Accuracy, Host, Measurement, StageCost, write_accuracy
from reflowshock.workflow.convergence.convergence_study import Quantity, StudyRun
from reflowshock.workflow.convergence.discretisation import COARSEST, STALE, discretisation, read_case_accuracy
from reflowshock.workflow.convergence.errors import Error, compute_errors
from reflowshock.workflow.convergence.page import section_for
from reflowshock.workflow.package_report.headline import headline, later_swings
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.report.errors import Discretisation, left_out, scheme_error
from reflowshock.workflow.store.keys import product_keys
from tests.support.workflow_command import SMALL_CASE

MEASURED = "numerics.error.method=measured"
COST = {"shock": StageCost(1.0, 1.0, None)}
ORDER = Error(0.04, "Richardson, order 1.6", 1.6)
NO_ORDER = Error(0.05, "finest run, all x 0.4")


def measurement(size: float, against: str = "", **errors: Error) -> Measurement:
    """Return a measurement at a size of a study, with errors of metrics."""
    return Measurement(f"all x {size}", "element size", size, {}, "", COST, errors, against=against)


@pytest.fixture
def study(tmp_path):
    """Return a case, its run folder and a study next to it that includes the mesh of the case."""
    case = read_case(SMALL_CASE, [MEASURED])
    runs = (measurement(2.0, peel_stress=Error(0.4, "")), measurement(1.0, peel_stress=ORDER, deflection=NO_ORDER))
    errors = {"peel_stress": "peel", "deflection": "deflection"}
    key = product_keys(case)["shock"]
    accuracy = Accuracy(case.case.name, case.kind, "reflowshock accuracy", Host("none", 1), errors, runs, {}, key=key)
    write_accuracy(tmp_path / "small-accuracy", accuracy)
    return case, tmp_path / "small", accuracy


def test_mesh_of_the_case_has_a_grid_convergence_index(study):
    case, folder, _ = study
    estimate = discretisation(folder, case)
    assert estimate.errors == {"peel_stress": pytest.approx(1.25 * 0.04), "deflection": pytest.approx(3.0 * 0.05)}
    assert estimate.text("peel_stress") == "±5 % (Richardson, order 1.6)"
    assert not estimate.text("peak_board_strain")


def test_report_in_a_store_finds_the_study_of_the_case(study):
    case, folder, accuracy = study
    work = folder / ".store/work/report-0123"
    work.mkdir(parents=True)
    assert read_case_accuracy(work, case) == accuracy
    assert not section_for(work, case)["stale"]


def test_errors_of_changed_inputs_are_stale(study):
    _, folder, _ = study
    changed = read_case(SMALL_CASE, [MEASURED, "shock.peak_acceleration=1000 G"])
    assert discretisation(folder, changed) == Discretisation(unknown=STALE)
    assert section_for(folder, changed)["stale"]


def test_changed_failure_limits_keep_the_errors_valid(study):
    _, folder, _ = study
    judged = read_case(SMALL_CASE, [MEASURED, 'shock.failure.peel_stress={ limit = "80 MPa", source = "a test" }'])
    assert "peel_stress" in discretisation(folder, judged).errors


def test_missing_errors_name_the_command_that_measures_them(study, tmp_path):
    case, folder, accuracy = study
    assert "accuracy measures it" in discretisation(tmp_path / "elsewhere/small", case).unknown
    partial = (measurement(1.0, against="all x 0.5", peel_stress=ORDER), measurement(2.0, peel_stress=ORDER))
    write_accuracy(tmp_path / "small-accuracy", replace(accuracy, measurements=partial))
    assert discretisation(folder, case).unknown == COARSEST


def test_errors_have_the_order_of_their_extrapolation():
    runs = [StudyRun(f"{size}", "size", {}, size) for size in (4.0, 2.0, 1.0)]
    results = {run.name: {"peel": Quantity(1.0 + 0.01 * run.value**2)} for run in runs}
    errors = compute_errors(results, runs, runs, None)
    assert errors["1.0"]["peel"].value == pytest.approx(0.01) and errors["1.0"]["peel"].order == pytest.approx(2.0)
    oscillating = {run.name: {"peel": Quantity(1.0 + 0.01 * (-1.0) ** index)} for index, run in enumerate(runs)}
    assert compute_errors(oscillating, runs, runs, None)["2.0"]["peel"].order is None


def result(windows: int = 100, **metrics: float | str) -> dict:
    """Return a synthetic summary with metrics and windows."""
    records = {name: {"value": value, "unit": ""} for name, value in metrics.items()}
    return {"metrics": records, "model": {"window": 1e-5, "windows": windows}}


def test_error_of_two_scales_is_the_difference_from_one_model():
    both = {
        "two_scale": result(peel_stress=6.3e7, critical_joint="A1"),
        "dns": result(peel_stress=6e7, critical_joint="A2"),
    }
    assert scheme_error("peel_stress", both) == "5 %"
    assert scheme_error("critical_joint", both) == "A2 in the DNS"
    assert not scheme_error("peak_board_strain", both)
    assert scheme_error("peel_stress", both | {"dns": result(50)}) == "the DNS ends at 0.5 ms"
    assert not scheme_error("peel_stress", {"two_scale": result()})
    assert not scheme_error("peel_stress", {"dns": result()})


def test_undamped_run_with_automatic_end_mentions_later_swings():
    shock = Shock(duration="auto", service_condition="B", damping={"estimate": "off"})
    assert "ends at 2.05 ms" in later_swings(shock, 2.05e-3)
    assert "decayed" in later_swings(Shock(duration="auto"), 2e-3, "decayed")
    assert not later_swings(shock.model_copy(update={"duration": 1e-3}), 1e-3)
    assert not later_swings(Shock(duration="auto", damping={"mass_ratio": 0.02, "frequency": 300.0}), 2e-3)


def test_omitted_effects_are_sorted_by_influence():
    effects = {
        "damping": {"on": False, "influence": 0.02}, "finite_rotation": {"on": False, "influence": 0.47},
        "gravity": {"on": False, "influence": 1e-3}, "plasticity": {"on": True, "influence": 0.5},
        "symmetry": {"on": False},
    }  # fmt: skip
    assert left_out(effects) == "finite rotation 47 %, damping 2 %"
    assert left_out({}) == "none with an expected influence above 1 %"


@pytest.mark.parametrize(
    "errors", [Discretisation(), Discretisation({"peel_stress": 0.04}, {"peel_stress": "Richardson"})]
)
def test_headline_table_has_the_errors_that_are_known(errors):
    metrics = {"critical_joint": {"value": "A1", "unit": ""}, "peel_stress": {"value": 6e7, "unit": "Pa"}}
    table = headline(metrics, errors, {"effects": {}}, {"dns": {"metrics": metrics, **result()}})
    assert [row[1] for row in table["rows"]] == ["A1", "60 MPa"]
    assert [row[2:] for row in table["rows"]] == ([["–"], ["±4 % (Richardson)"]] if errors.errors else [[], []])
    assert len(table["head"]) == len(table["rows"][0])
    assert ("accuracy measures it" in table["note"]) is not bool(errors.errors)
