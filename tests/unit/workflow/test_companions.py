"""Companions of a drop on coarser meshes: parameters, when they run, where they stay, and the errors from them."""

import json
from pathlib import Path

import numpy as np
import pytest

from reflowshock.workflow.board_drop.companions import SIZES, companions
from reflowshock.workflow.board_drop.fine_joints import FineJoints, write_fine_joints
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.run import Run, metric
from reflowshock.workflow.convergence.discretisation import NOT_RUN, OFF, discretisation
from reflowshock.workflow.convergence.error_estimate import FILE, estimate_errors
from reflowshock.workflow.jobs.batch import list_missing, prepare, show_products
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.pipeline.companions import companion_points, companion_seconds
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.store.companions import FAILED, companion_folder
from reflowshock.workflow.store.folders import lock_folder
from reflowshock.workflow.store.keys import product_keys
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.store.view import remove_unused
from tests.support.products import make, record_of
from tests.support.workflow_command import SMALL_CASE

ESTIMATE = ["numerics.error.method=estimate"]


def drop(*settings: str) -> BoardDropCase:
    """Return the shortened case with an error estimate."""
    case = read_case(SMALL_CASE, [*ESTIMATE, *settings])
    assert isinstance(case, BoardDropCase)
    return case


CASE = drop()
POINT = Point({}, CASE)
UNTIL_SHOCK = ["geometry", "reflow", "surface", "solder_mesh", "shock"]


@pytest.fixture
def store(tmp_path) -> Store:
    store = Store(tmp_path / "run", one_run=True)
    with lock_folder(store.folder, "run", "small"):
        make(store, POINT, UNTIL_SHOCK)
    return store


def test_companions_have_larger_elements_and_share_the_solder():
    copies = companions(CASE, None)
    assert tuple(copies) == SIZES
    for size, copy in copies.items():
        assert copy.board.numerics.element_size == pytest.approx(size * CASE.board.numerics.element_size)
        assert copy.package.substrate == CASE.package.substrate
        assert (copy.shock.ranks.total, copy.shock.numerics.modes) == (1, ("two_scale",))
        assert "errors" not in copy.pipeline.names and not companions(copy, None)
        keys = product_keys(copy)
        same = {name for name in keys if keys[name] == POINT.digests[name]}
        assert same == {"reflow", "surface"}


def test_layers_of_the_averaging_layer_stay():
    resolved = drop("package.joint_numerics={layers=6, pad_layer='0.025 mm'}")
    numerics = companions(resolved, None)[2.0].package.joint_numerics
    assert (numerics.layers, numerics.pad_layers, numerics.core) == (6, 2, 1)


def test_fine_joints_and_end_are_those_of_the_run(tmp_path):
    case = drop("shock.coupling.fine_joints=critical", "shock.duration=auto")
    expected = companions(case, None)[2.0]
    assert len(expected.shock.coupling.fine_joints) == 3 and isinstance(expected.shock.duration, float)
    write_fine_joints(tmp_path, FineJoints(("B4",), "a test"))
    (tmp_path / "two_scale").mkdir()
    (tmp_path / "two_scale/result.json").write_text(json.dumps({"model": {"window": 1e-7, "windows": 20}}))
    decided = companions(case, tmp_path)[2.0].shock
    assert decided.coupling.fine_joints == ("B4",) and decided.duration == pytest.approx(2e-6)


def test_the_method_changes_only_errors_and_report():
    without = Point({}, read_case(SMALL_CASE, ["numerics.error.method=off"]))
    assert {name for name in POINT.digests if POINT.digests[name] != without.digests.get(name)} == {"errors", "report"}
    assert discretisation(Path("nowhere"), without.case).unknown == OFF
    assert discretisation(Path("nowhere"), CASE).unknown == NOT_RUN


def test_a_wrong_method_is_refused_with_the_nearest_one():
    with pytest.raises(CaseError, match=r'numerics.error.method = "estimat".*did you mean estimate\?'):
        read_case(SMALL_CASE, ["numerics.error.method=estimat"])


def test_companions_run_between_shock_and_errors(tmp_path, store):
    fresh = Store(tmp_path / "fresh", one_run=True)
    assert [job.stage for job in list_missing(fresh, [POINT], "report")] == UNTIL_SHOCK
    assert list(companion_seconds(fresh, POINT)) == list(SIZES)
    assert list_missing(store, [POINT], "shock") == []
    jobs = list_missing(store, [POINT], "report")
    assert [(job.stage, job.is_of_companion) for job in jobs] == 2 * [
        ("geometry", True), ("solder_mesh", True), ("shock", True),
    ]  # fmt: skip
    for point in companion_points(store, POINT).values():
        make(store, point, ["geometry", "solder_mesh", "shock"])
    assert [job.stage for job in list_missing(store, [POINT], "report")] == ["errors", "report"]
    assert companion_seconds(store, POINT) == {}


def test_a_failed_companion_is_tried_once_and_its_message_reported(store):
    tried = {job.name for job in list_missing(store, [POINT], "report")}
    jobs = list_missing(store, [POINT], "report", tried)
    assert [job.stage for job in jobs] == ["errors", "report"]
    prepare(store, jobs[0])
    message = companion_folder(store.work_folder(POINT, "errors"), 1.5) / FAILED
    assert message.read_text() == "stage geometry failed: ended without a message"


def test_companions_stay_in_the_run_folder(store):
    with lock_folder(store.folder, "run", "small"):
        for point in companion_points(store, POINT).values():
            make(store, point, ["geometry", "solder_mesh", "shock"])
        show_products(store, POINT)
        assert (companion_folder(store.folder, 2.0) / "shock/stage.json").is_file()
        assert remove_unused(store) == (0, 0)


def shock_of(folder: Path, value: float) -> None:
    """Write a shock of two joints, the second of which is critical on the finest mesh only."""
    (folder / "two_scale").mkdir(parents=True)
    load = np.array([[0.0, 0.0], [3.0, value]])
    sections = np.zeros((2, 2, 6))
    histories = {f"{name}_{end}": load for name in ("peel", "von_mises", "outer_fibre") for end in ("board", "package")}
    histories |= {f"section_{end}": sections for end in ("board", "package")}
    np.savez(folder / "two_scale/history.npz", joints=np.array(["A1", "A2"]), **histories)
    metrics = {"critical_joint": metric("A2" if value > 3.0 else "A1"), "peak_element_stress": metric(value, "Pa")}
    record_of(folder, metrics=metrics | {"peak_board_strain": metric(1e-3 * value)})


def test_errors_are_those_of_the_critical_joint_of_the_run(tmp_path):
    for folder, size in ((tmp_path, 1.0), *((companion_folder(tmp_path, size), size) for size in SIZES)):
        shock_of(folder / "shock", 4.0 - 0.5 * size**2)
    made = tmp_path / "errors"
    made.mkdir()
    found = estimate_errors(Run(tmp_path, CASE, 1), made)
    assert found.metrics["companion_cost_share"] == metric(2.0)
    errors = json.loads((made / FILE).read_text())
    assert errors["peel_stress"] == {
        "discretisation": pytest.approx(1.25 * 0.5 / 3.5), "order": pytest.approx(2.0), "how": "order 2",
    }  # fmt: skip
    assert errors["peak_board_strain"]["order"] == pytest.approx(2.0)
    assert errors["section_axial_force"]["discretisation"] is None
    assert errors["peak_element_stress"]["how"] == "grows with refinement"
    known = discretisation(tmp_path, CASE)
    assert known.text("peel_stress") == "±17.9 % (order 2)"
    assert known.record({})["peel_stress"]["two_scale"] is None


def test_a_missing_companion_leaves_the_errors_unknown(tmp_path):
    shock_of(tmp_path / "shock", 3.5)
    made = tmp_path / "errors"
    made.mkdir()
    assert estimate_errors(Run(tmp_path, CASE, 1), made).health == {}
    how = json.loads((made / FILE).read_text())["peel_stress"]["how"]
    assert how == "the run with elements x 1.5: has not run; the run with elements x 2: has not run"
