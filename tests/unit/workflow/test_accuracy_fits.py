"""Errors, fits of errors and costs, and the Pareto front of a study, on synthetic values."""

from pathlib import Path

import numpy as np
import pytest

from reflowshock.workflow.accuracy.recommend import Goal, recommend
from reflowshock.workflow.case.case import CASES
from reflowshock.workflow.convergence.accuracy_file import (
    Accuracy,
    Measurement,
    Recommended,
    StageCost,
    fit_measurements,
    read_accuracy,
    this_host,
    write_accuracy,
)
from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy, Parameter, Quantity, StudyRun
from reflowshock.workflow.convergence.errors import Error, compute_errors, richardson
from reflowshock.workflow.convergence.fits import fit_cost, fit_error
from reflowshock.workflow.convergence.tables import front

SIZES = (0.4, 0.2, 0.1, 0.05)


def run_at(size: float) -> StudyRun:
    """Return the run of a study with a particle spacing [mm]."""
    return StudyRun(f"size {size:g}", "size", {"drop.spacing": f"{size} mm"}, size)


RUNS = [run_at(size) for size in SIZES]
STUDY = ConvergenceStudy(
    "reflow", ("reflow",), {"height": "height"}, lambda _case, _folder: {}, (Parameter("size", SIZES, run_at, 2.0),)
)


def results(exact: float | None) -> dict:
    """Return run -> synthetic height with an error of second order."""
    return {run.name: {"height": Quantity(3.0 + 2.0 * run.value**2, exact)} for run in RUNS}


def test_errors_are_against_the_exact_value():
    errors = compute_errors(results(3.0), RUNS, RUNS, 2.0)
    assert errors["size 0.2"]["height"] == Error(pytest.approx(0.08 / 3.0), "exact")
    assert set(errors) == {run.name for run in RUNS}


def test_three_runs_are_extrapolated_without_an_exact_value():
    errors = compute_errors(results(None), RUNS, RUNS, 2.0)
    assert errors["size 0.05"]["height"] == Error(
        pytest.approx(0.005 / 3.0), "Richardson, order 2", order=pytest.approx(2.0)
    )


def test_each_sample_is_extrapolated():
    values = [np.array([1.0, 2.0]) + np.array([0.5, -1.0]) * size**1.5 for size in SIZES[1:]]
    limit, order = richardson(SIZES[1:], values, None)
    assert limit == pytest.approx([1.0, 2.0]) and order == pytest.approx(1.5)


def test_runs_without_the_theoretical_order_are_not_extrapolated():
    assert richardson(SIZES[1:], [1.0 + size for size in SIZES[1:]], 2.0) is None
    assert richardson(SIZES[1:], [1.0, 1.2, 1.1], None) is None
    first_order = {run.name: {"height": Quantity(3.0 + run.value)} for run in RUNS}
    errors = compute_errors(first_order, RUNS, RUNS, 2.0)
    assert "size 0.05" not in errors
    assert errors["size 0.1"]["height"].against == "finest run, size 0.05"


def test_run_may_name_its_reference():
    scheme = StudyRun("one way", "scheme", {}, against="size 0.1")
    with_scheme = results(3.0) | {"one way": {"height": Quantity(3.02 * 1.01, 3.0)}}
    errors = compute_errors(with_scheme, [*RUNS, scheme], RUNS, 2.0)
    assert errors["one way"]["height"] == Error(pytest.approx(0.01), "run size 0.1")


def test_value_is_not_compared_with_errors():
    scheme = StudyRun("scheme", "scheme", {})
    errors_of_runs = {run.name: {"height": Quantity(run.value**2, 0.0, 1.0)} for run in RUNS}
    errors_of_runs["scheme"] = {"height": Quantity(3.0)}
    assert "scheme" not in compute_errors(errors_of_runs, [*RUNS, scheme], RUNS, 2.0)


def test_value_without_a_scale_has_no_error():
    zero_exact = {run.name: {"height": Quantity(run.value, 0.0)} for run in RUNS}
    assert compute_errors(zero_exact, RUNS, RUNS, 2.0) == {}


def test_failed_run_has_no_error():
    completed = results(3.0)
    del completed["size 0.1"]
    assert "size 0.1" not in compute_errors(completed, RUNS, RUNS, 2.0)


def test_value_that_is_not_finite_has_no_error():
    with_nan = results(3.0) | {"size 0.1": {"height": Quantity(float("nan"), 3.0)}}
    errors = compute_errors(with_nan, RUNS, RUNS, 2.0)
    assert "size 0.1" not in errors and "size 0.2" in errors


def test_fits_recover_their_coefficients():
    errors = fit_error(SIZES, [3.0 * size**2 for size in SIZES], 2.0)
    assert (errors.constant, errors.order, errors.scatter) == pytest.approx((3.0, 2.0, 1.0))
    assert errors.at(errors.value_for(1e-3)) == pytest.approx(1e-3)
    cost = fit_cost(SIZES, [2.0 + 0.1 * size**-4 for size in SIZES])
    assert (cost.start, cost.constant, cost.exponent) == pytest.approx((2.0, 0.1, 4.0), rel=1e-3)
    assert fit_cost(SIZES[:3], [1.0, 3.0, 4.0]) is None
    assert cost.at(0.07) == pytest.approx(2.0 + 0.1 * 0.07**-4, rel=1e-2)


def test_scatter_lowers_the_value_for_an_error():
    fit = fit_error(SIZES, [size**2 * factor for size, factor in zip(SIZES, (1.0, 1.2, 0.9, 1.0), strict=True)])
    assert fit.scatter > 1.1
    assert fit.at(fit.value_for(1e-2)) == pytest.approx(1e-2 / fit.scatter)


def test_errors_that_do_not_converge_have_no_order():
    assert fit_error(SIZES, [1.0, 1.0, 1.1, 1.2]) is None
    assert fit_error(SIZES[:2], [2.0, 1.0]) is None
    assert fit_error(SIZES, [1.0, 0.5, 0.0, 0.1]) is None


def test_pareto_front_has_no_dominated_run():
    assert front([1.0, 2.0, 3.0, 4.0], [0.5, 0.6, 0.2, 0.2]) == [0, 2]


def test_accuracy_file_restores_a_study(tmp_path: Path):
    measured = {run.name: _measurement(run) for run in RUNS}
    chosen = Recommended(RUNS[1], "cheapest", 1e-3, 2.0, measured["size 0.2"])
    fits = fit_measurements(STUDY, measured)
    assert fits["size"].errors["height"].order == pytest.approx(2.0)
    assert fits["size"].cost.exponent == pytest.approx(3.0, rel=1e-3)
    complete = Accuracy("bar", "drop", "accuracy", this_host(), {"height": "height"}, tuple(measured.values()), fits)
    for accuracy in (
        complete,
        Accuracy(**{name: getattr(complete, name) for name in complete.__slots__} | {"recommended": chosen}),
    ):
        write_accuracy(tmp_path, accuracy)
        assert read_accuracy(tmp_path / "accuracy.json") == accuracy
    assert read_accuracy(tmp_path / "does not exist") is None
    assert all(read_accuracy(path) for path in CASES.glob("*/accuracy.json"))
    (tmp_path / "accuracy.json").write_text('{"of": "another version"}')
    assert read_accuracy(tmp_path / "accuracy.json") is None


def test_value_finer_than_all_completed_runs_is_not_recommended():
    sizes = (*SIZES, 0.01)
    study = ConvergenceStudy(
        "reflow", ("reflow",), {"height": "height"}, STUDY.measure, (Parameter("size", sizes, run_at, 2.0),)
    )
    failed = Measurement("size 0.01", "size", 0.01, {}, "abc", {}, {}, "it broke")
    measured = {run.name: _measurement(run) for run in RUNS} | {failed.run: failed}
    chosen = recommend(study, measured, fit_measurements(study, measured), Goal(0.02**2))
    assert chosen.run.name == "size 0.05" and "no setting is within the tolerance" in chosen.why


def _measurement(run: StudyRun) -> Measurement:
    cost = StageCost(1.0, 1.0 + run.value**-3, 0.9)
    errors = {"height": Error(run.value**2, "exact")}
    return Measurement(run.name, run.parameter, run.value, run.settings, "abc", {"reflow": cost}, errors)
