"""Errors, orders, costs and the Pareto front of a study, on answers that are known."""

from pathlib import Path

import numpy as np
import pytest

from reflowshock.workflow.accuracy.recommend import Goal, recommend
from reflowshock.workflow.case.case import CASES
from reflowshock.workflow.convergence.errors import Error, errors_of, richardson
from reflowshock.workflow.convergence.measured import (
    Accuracy,
    Measurement,
    Recommended,
    StageCost,
    fits_of,
    read_accuracy,
    this_host,
    write_accuracy,
)
from reflowshock.workflow.convergence.orders import fit_cost, fit_error
from reflowshock.workflow.convergence.series import ConvergenceStudy, Parameter, Quantity, StudyRun
from reflowshock.workflow.convergence.tables import front

SIZES = (0.4, 0.2, 0.1, 0.05)


def run(size: float) -> StudyRun:
    return StudyRun(f"size {size:g}", "size", {"drop.spacing": f"{size} mm"}, size)


RUNS = [run(size) for size in SIZES]
STUDY = ConvergenceStudy(
    "reflow", ("reflow",), {"height": "height"}, lambda _case, _folder: {}, (Parameter("size", SIZES, run, 2.0),)
)


def answers(exact: float | None) -> dict:
    return {one.name: {"height": Quantity(3.0 + 2.0 * one.value**2, exact)} for one in RUNS}


def test_an_exact_answer_is_compared_with():
    errors = errors_of(answers(3.0), RUNS, RUNS, 2.0)
    assert errors["size 0.2"]["height"] == Error(pytest.approx(0.08 / 3.0), "exact")
    assert set(errors) == {one.name for one in RUNS}


def test_without_it_three_runs_are_extrapolated():
    errors = errors_of(answers(None), RUNS, RUNS, 2.0)
    assert errors["size 0.05"]["height"] == Error(
        pytest.approx(0.005 / 3.0), "Richardson, order 2", order=pytest.approx(2.0)
    )


def test_samples_are_extrapolated_each():
    values = [np.array([1.0, 2.0]) + np.array([0.5, -1.0]) * size**1.5 for size in SIZES[1:]]
    limit, order = richardson(SIZES[1:], values, None)
    assert limit == pytest.approx([1.0, 2.0]) and order == pytest.approx(1.5)


def test_runs_without_the_order_of_theory_are_not_extrapolated():
    assert richardson(SIZES[1:], [1.0 + size for size in SIZES[1:]], 2.0) is None
    assert richardson(SIZES[1:], [1.0, 1.2, 1.1], None) is None
    found = {one.name: {"height": Quantity(3.0 + one.value)} for one in RUNS}
    errors = errors_of(found, RUNS, RUNS, 2.0)
    assert "size 0.05" not in errors
    assert errors["size 0.1"]["height"].against == "finest run, size 0.05"


def test_a_run_may_name_what_it_is_compared_with():
    scheme = StudyRun("one way", "scheme", {}, against="size 0.1")
    found = answers(3.0) | {"one way": {"height": Quantity(3.02 * 1.01, 3.0)}}
    errors = errors_of(found, [*RUNS, scheme], RUNS, 2.0)
    assert errors["one way"]["height"] == Error(pytest.approx(0.01), "run size 0.1")


def test_an_answer_is_not_compared_with_errors():
    lost = StudyRun("lost", "scheme", {})
    found = {one.name: {"height": Quantity(one.value**2, 0.0, 1.0)} for one in RUNS}
    found["lost"] = {"height": Quantity(3.0)}
    assert "lost" not in errors_of(found, [*RUNS, lost], RUNS, 2.0)


def test_what_is_relative_to_nothing_has_no_error():
    found = {one.name: {"height": Quantity(one.value, 0.0)} for one in RUNS}
    assert errors_of(found, RUNS, RUNS, 2.0) == {}


def test_a_run_that_failed_has_no_error():
    found = answers(3.0)
    del found["size 0.1"]
    assert "size 0.1" not in errors_of(found, RUNS, RUNS, 2.0)


def test_an_answer_that_is_not_finite_has_no_error():
    found = answers(3.0) | {"size 0.1": {"height": Quantity(float("nan"), 3.0)}}
    errors = errors_of(found, RUNS, RUNS, 2.0)
    assert "size 0.1" not in errors and "size 0.2" in errors


def test_fits_find_what_they_were_made_of():
    errors = fit_error(SIZES, [3.0 * size**2 for size in SIZES], 2.0)
    assert (errors.constant, errors.order, errors.scatter) == pytest.approx((3.0, 2.0, 1.0))
    assert errors.at(errors.value_for(1e-3)) == pytest.approx(1e-3)
    cost = fit_cost(SIZES, [2.0 + 0.1 * size**-4 for size in SIZES])
    assert (cost.start, cost.constant, cost.exponent) == pytest.approx((2.0, 0.1, 4.0), rel=1e-3)
    assert fit_cost(SIZES[:3], [1.0, 3.0, 4.0]) is None
    assert cost.at(0.07) == pytest.approx(2.0 + 0.1 * 0.07**-4, rel=1e-2)


def test_a_scattered_error_is_allowed_for():
    fit = fit_error(SIZES, [size**2 * factor for size, factor in zip(SIZES, (1.0, 1.2, 0.9, 1.0), strict=True)])
    assert fit.scatter > 1.1
    assert fit.at(fit.value_for(1e-2)) == pytest.approx(1e-2 / fit.scatter)


def test_errors_that_do_not_fall_have_no_order():
    assert fit_error(SIZES, [1.0, 1.0, 1.1, 1.2]) is None
    assert fit_error(SIZES[:2], [2.0, 1.0]) is None
    assert fit_error(SIZES, [1.0, 0.5, 0.0, 0.1]) is None


def test_the_front_is_what_nothing_beats():
    assert front([1.0, 2.0, 3.0, 4.0], [0.5, 0.6, 0.2, 0.2]) == [0, 2]


def test_a_measurement_comes_back_from_its_file(tmp_path: Path):
    measured = {one.name: _measurement(one) for one in RUNS}
    chosen = Recommended(RUNS[1], "cheapest", 1e-3, 2.0, measured["size 0.2"])
    fits = fits_of(STUDY, measured)
    assert fits["size"].errors["height"].order == pytest.approx(2.0)
    assert fits["size"].cost.exponent == pytest.approx(3.0, rel=1e-3)
    whole = Accuracy("bar", "drop", "accuracy", this_host(), {"height": "height"}, tuple(measured.values()), fits)
    for accuracy in (
        whole,
        Accuracy(**{name: getattr(whole, name) for name in whole.__slots__} | {"recommended": chosen}),
    ):
        write_accuracy(tmp_path, accuracy)
        assert read_accuracy(tmp_path / "accuracy.json") == accuracy
    assert read_accuracy(tmp_path / "does not exist") is None
    assert all(read_accuracy(path) for path in CASES.glob("*/accuracy.json"))
    (tmp_path / "accuracy.json").write_text('{"of": "another version"}')
    assert read_accuracy(tmp_path / "accuracy.json") is None


def test_what_is_finer_than_all_runs_that_came_to_their_end_is_not_chosen():
    sizes = (*SIZES, 0.01)
    study = ConvergenceStudy(
        "reflow", ("reflow",), {"height": "height"}, STUDY.measure, (Parameter("size", sizes, run, 2.0),)
    )
    failed = Measurement("size 0.01", "size", 0.01, {}, "abc", {}, {}, "it broke")
    measured = {one.name: _measurement(one) for one in RUNS} | {failed.run: failed}
    chosen = recommend(study, measured, fits_of(study, measured), Goal(0.02**2))
    assert chosen.run.name == "size 0.05" and "no setting is within the tolerance" in chosen.why


def _measurement(one: StudyRun) -> Measurement:
    cost = StageCost(1.0, 1.0 + one.value**-3, 0.9)
    errors = {"height": Error(one.value**2, "exact")}
    return Measurement(one.name, one.parameter, one.value, one.settings, "abc", {"reflow": cost}, errors)
