"""Reference design: ratios of loads to a run that survives, and errors before anything is computed."""

import json

import pytest

from reflowshock.fem.problem.failure import Failure
from reflowshock.parameters import with_value
from reflowshock.problem import Problem
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.run import Findings, StageError, at_most, metric
from reflowshock.workflow.jobs.batch import show_products
from reflowshock.workflow.package import reference
from reflowshock.workflow.package.case import BOARD_DROP
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.run import run_case
from reflowshock.workflow.store.keys import product_keys, stage_inputs
from reflowshock.workflow.store.product import SEAL
from reflowshock.workflow.store.store import CASE, Store, write_case
from reflowshock.workflow.verdict.criterion import JudgedDrop
from reflowshock.workflow.verdict.ratios import RATIOS, ReferenceRatio, ratio_of
from tests.support.products import POINT, make
from tests.support.workflow_command import SMALL_CASE

METRICS = {
    "peel_stress": metric(2e7, "Pa"), "layer_plastic_work": metric(1e5, "J/m^3"), "peak_board_strain": metric(1e-3),
    "joint_layer": metric(25e-6, "m"), "simulated_time": metric(2e-3, "s"), "critical_joint": metric("A4"),
}  # fmt: skip


@pytest.fixture
def base(tmp_path):
    """The run folder of a reference with all its products."""
    store = Store(tmp_path / "base", one_run=True)
    make(store, POINT, BOARD_DROP.names, findings=Findings(METRICS))
    show_products(store, POINT)
    return store


def read(folder, *settings):
    """Return the shortened case with a reference run in a folder."""
    return read_case(SMALL_CASE, [f"shock.failure.reference.run={folder}", *settings])


def fault(folder, *settings) -> Problem:
    """Return the message of the only problem of a reference run."""
    with pytest.raises(CaseError) as error:
        read(folder, *settings)
    (problem,) = error.value.problems
    assert problem.key == reference.KEY and problem.allowed
    return problem.message


def judged(reference_metrics, **changes):
    """Return ratio name -> verdict on a drop against reference metrics."""
    failure = Failure.model_validate({"reference": {"run": "runs/base", **changes}})
    drop = JudgedDrop(with_value(POINT.case, "shock.failure", failure), METRICS, {}, (), reference_metrics)
    return {name: ReferenceRatio(name).judge(drop) for name in RATIOS}


def test_a_design_passes_against_itself():
    ratios = judged(METRICS)
    assert {item.value for item in ratios.values()} == {1.0} and {item.verdict for item in ratios.values()} == {"PASS"}
    assert {item.source for item in ratios.values()} == {"run base, taken to survive"}
    assert [item.name for item in ratios.values()] == [
        "reference_plastic_work", "reference_peel_stress", "reference_board_strain"
    ]  # fmt: skip


def test_a_larger_load_fails_unless_the_largest_ratio_allows_it():
    half = METRICS | {"peel_stress": metric(1e7, "Pa")}
    strict = judged(half, source="30 drops of the old design")["peel_stress"]
    assert (strict.value, strict.margin, strict.verdict) == (2.0, 0.5, "FAIL")
    assert strict.source == "run base, 30 drops of the old design"
    assert judged(half, largest_ratio=2.5)["peel_stress"].margin == 1.25


@pytest.mark.parametrize(
    ("name", "metrics", "why"),
    [
        ("layer_plastic_work", {"joint_layer": metric(5e-5, "m")}, "different layers of solder, 0.025 mm and 0.05 mm"),
        ("peel_stress", {"peel_stress": metric(-1.0, "Pa")}, "peel stress of the reference is not positive"),
    ],
)
def test_ratios_that_mean_nothing_are_left_out_with_the_reason(name, metrics, why):
    ratio = ratio_of(name, METRICS, METRICS | metrics)
    assert ratio.value is None and why in ratio.why


def test_plastic_work_needs_solder_that_yields_in_both():
    elastic = {name: value for name, value in METRICS.items() if name != "layer_plastic_work"}
    assert "the reference, whose solder does not yield" in ratio_of("layer_plastic_work", METRICS, elastic).why
    assert "this run, whose solder does not yield" in ratio_of("layer_plastic_work", elastic, METRICS).why


def test_another_end_time_is_mentioned():
    longer = METRICS | {"simulated_time": metric(3e-3, "s")}
    assert "end at 2 ms and, the reference, 3 ms" in judged(longer)["peel_stress"].why


def test_the_figures_of_a_reference_are_inputs_of_the_report_alone(base):
    case = read(base.folder)
    assert reference.metrics_of(case.shock.failure.reference) == METRICS
    keys, plain = product_keys(case), product_keys(POINT.case)
    assert [name for name in keys if keys[name] != plain[name]] == ["report"]
    assert f"{reference.KEY}.sha256" in stage_inputs(case, case.pipeline["report"])


def test_a_case_file_stands_for_its_run_folder(base, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    base.folder.rename(tmp_path / "runs/small")
    assert read(SMALL_CASE).shock.failure.reference.run == str(tmp_path / "runs/small")


def test_a_missing_run_is_refused(tmp_path):
    assert fault(tmp_path / "none") == "does not exist"
    assert fault(tmp_path) == "is not a run folder"
    assert fault(tmp_path / "none.toml") == "does not exist"
    (tmp_path / "nameless.toml").write_text("[package]\n")
    assert fault(tmp_path / "nameless.toml") == "is a case file without case.name"


def test_a_run_of_another_kind_is_refused(tmp_path):
    write_case(tmp_path, read_case(SMALL_CASE.parents[2] / "cases/bar_wave/case.toml"))
    assert fault(tmp_path) == "is not the run of a dropped package: its case has no [package]"


def test_a_damaged_case_is_refused(base):
    path = base.folder / CASE
    path.write_text(json.dumps(json.loads(path.read_text()) | {SEAL: "0"}))
    assert "is damaged: " in fault(base.folder)


def test_a_damaged_product_is_refused(base):
    next(base.product(POINT, "shock").glob("*.json")).write_text("{}")
    assert fault(base.folder).startswith("is damaged: shock: stage.json was modified")


def test_a_stale_run_is_refused(base):
    write_case(base.folder, read_case(SMALL_CASE, ["shock.peak_acceleration=1000 G"]))
    assert fault(base.folder) == "is stale: shock: shock.peak_acceleration changed after it was computed; run it again"


def test_an_unhealthy_run_is_refused(tmp_path):
    store = Store(tmp_path / "base", one_run=True)
    make(store, POINT, BOARD_DROP.names, findings=Findings(METRICS, {"energy_balance_error": at_most(1.0, 0.1)}))
    show_products(store, POINT)
    assert fault(store.folder).startswith("failed the health check energy balance error")


def test_a_reference_that_vanishes_is_reported_by_the_report(tmp_path):
    given = Failure.model_validate({"reference": {"run": str(tmp_path)}}).reference
    with pytest.raises(StageError, match="missing or damaged"):
        reference.metrics_of(given)


def test_a_run_does_not_replace_its_own_reference(base):
    point = type(POINT)({}, read(base.folder))
    with pytest.raises(CaseError, match="choose another --out"):
        run_case(base, point, "report", None)


def test_values_out_of_range_are_refused(base):
    with pytest.raises(CaseError, match=r"largest_ratio.*out of range"):
        read(base.folder, "shock.failure.reference.largest_ratio=0")
