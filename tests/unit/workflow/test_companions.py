"""Companions of a drop on coarser meshes: parameters, when they run, where they stay, and the errors from them."""

import json
from pathlib import Path

import numpy as np
import pytest

from reflowshock.workflow.board_drop.fine_joints import FineJoints, write_fine_joints
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.run import Run, metric
from reflowshock.workflow.convergence.discretisation import NOT_RUN, OFF, discretisation
from reflowshock.workflow.convergence.drop_companions import drop_companions, drop_sizes
from reflowshock.workflow.convergence.error_estimate import FILE, Reading, estimate_errors
from reflowshock.workflow.convergence.figures import drop_family, drop_figures, reading_distances
from reflowshock.workflow.convergence.structure_companions import structure_companions, structure_sizes
from reflowshock.workflow.jobs.batch import list_missing, prepare, show_products
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.pipeline.companions import companion_points, companion_seconds
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.store.companions import COARSEST, FAILED, HALF_WINDOW, SIZES, companion_folder, size_name
from reflowshock.workflow.store.folders import lock_folder
from reflowshock.workflow.store.keys import product_keys
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.store.view import remove_unused
from reflowshock.workflow.structure.case import StructureCase
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
    copies = drop_companions(CASE, None)
    assert tuple(copies) == tuple(map(size_name, SIZES))
    for size, copy in zip(SIZES, copies.values(), strict=True):
        assert copy.board.numerics.element_size == pytest.approx(size * CASE.board.numerics.element_size)
        assert copy.package.substrate.elements == max(1, round(CASE.package.substrate.elements / size))
        assert (copy.shock.ranks.total, copy.shock.numerics.modes) == (1, ("two_scale",))
        assert "errors" not in copy.pipeline.names and not drop_companions(copy, None)
        keys = product_keys(copy)
        same = {name for name in keys if keys[name] == POINT.digests[name]}
        assert same == {"reflow", "surface"}


def test_joints_have_fewer_layers_in_the_same_averaging_layer():
    resolved = drop("package.joint_numerics={layers=6, pad_layer='0.025 mm'}")
    numerics = drop_companions(resolved, None)[COARSEST].package.joint_numerics
    assert (numerics.layers, numerics.pad_layers, numerics.core, numerics.pad_layer) == (3, 1, 1, 25e-6)


def test_fine_joints_and_end_are_those_of_the_run(tmp_path):
    case = drop("shock.coupling.fine_joints=critical", "shock.duration=auto")
    expected = drop_companions(case, None)[COARSEST]
    assert len(expected.shock.coupling.fine_joints) == 3 and isinstance(expected.shock.duration, float)
    write_fine_joints(tmp_path, FineJoints(("B4",), "a test"))
    (tmp_path / "two_scale").mkdir()
    (tmp_path / "two_scale/result.json").write_text(json.dumps({"model": {"window": 1e-7, "windows": 20}}))
    decided = drop_companions(case, tmp_path)[COARSEST].shock
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
    assert list(companion_seconds(fresh, POINT)) == [size_name(size) for size in SIZES]
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
    message = companion_folder(store.work_folder(POINT, "errors"), "size_1.5") / FAILED
    assert message.read_text() == "stage geometry failed: ended without a message"


def test_companions_stay_in_the_run_folder(store):
    with lock_folder(store.folder, "run", "small"):
        for point in companion_points(store, POINT).values():
            make(store, point, ["geometry", "solder_mesh", "shock"])
        show_products(store, POINT)
        assert (companion_folder(store.folder, COARSEST) / "shock/stage.json").is_file()
        assert remove_unused(store) == (0, 0)


def shock_of(folder: Path, value: float, model: str = "two_scale", windows: int = 300) -> None:
    """Write results of a model of two joints, the second of which is critical on the finest mesh only."""
    results = folder / model
    results.mkdir(parents=True)
    load = np.array([[0.0, 0.0], [3.0, value]])
    sections = np.zeros((2, 2, 6))
    histories = {f"{name}_{end}": load for name in ("peel", "von_mises", "outer_fibre") for end in ("board", "package")}
    histories |= {
        "time": np.array([0.0, 1.5e-5]),
        "board_strain": 1e-3 * load[:, 1],
        "board_centre": sections[0, :, :3],
    }
    histories |= {f"section_{end}": sections for end in ("board", "package")}
    np.savez(results / "history.npz", joints=np.array(["A1", "A2"]), **histories)
    metrics = {"critical_joint": metric("A2" if value > 3.0 else "A1"), "peak_element_stress": metric(value, "Pa")}
    metrics |= {"peak_board_strain": metric(1e-3 * value)}
    coupling = {"scheme": "held_velocity"} if model == "two_scale" else {}
    model_record = {"window": 1e-7, "windows": windows}
    (results / "result.json").write_text(
        json.dumps({"metrics": metrics, "coupling": coupling, "model": model_record}), encoding="utf-8"
    )
    record_of(folder)


def estimated(folder: Path) -> dict:
    """Return ``errors.json`` of a run folder."""
    made = folder / "errors"
    made.mkdir()
    found = estimate_errors(Reading(drop_figures, drop_sizes, drop_family), Run(folder, CASE, 1), made)
    assert found.metrics["companion_cost_share"]["value"] >= 0.0 and found.health == {}
    errors: dict = json.loads((made / FILE).read_text())
    return errors


def run_with_companions(folder: Path) -> None:
    """Write a shock with a figure of second order, and its companions on two coarser meshes."""
    for shock, size in ((folder, 1.0), *((companion_folder(folder, size_name(size)), size) for size in SIZES)):
        shock_of(shock / "shock", 4.0 - 0.5 * size**2)


def test_errors_are_those_of_the_critical_joint_of_the_run(tmp_path):
    run_with_companions(tmp_path)
    shock_of(tmp_path / "shock", 3.6, "dns")
    errors = estimated(tmp_path)
    assert errors["peel_stress"] == {
        "discretisation": pytest.approx(1.25 * 0.5 / 3.5), "order": pytest.approx(2.0), "how": "order 2",
        "two_scale": pytest.approx(0.1 / 3.6), "two_scale_how": "one model on the same mesh",
    }  # fmt: skip
    assert errors["peak_board_strain"]["order"] == pytest.approx(2.0)
    assert errors["section_axial_force"]["discretisation"] is None
    assert errors["peak_element_stress"]["how"] == "grows with refinement"
    known = discretisation(tmp_path, CASE)
    assert known.text("peel_stress") == "±17.9 % (order 2)"
    record = known.record({})["peel_stress"]
    assert record["two_scale"] == pytest.approx(0.1 / 3.6)
    assert record["how"] == "order 2; two scales: one model on the same mesh"


@pytest.mark.parametrize(
    ("windows", "how"), [(200, "one model on the same mesh, until 0.02 ms"), (100, "elements x 2")]
)
def test_one_model_that_ends_early_counts_for_half_of_the_run(windows, how, tmp_path):
    run_with_companions(tmp_path)
    shock_of(tmp_path / "shock", 3.6, "dns", windows)
    shock_of(companion_folder(tmp_path, COARSEST) / "shock", 2.5, "dns")
    assert how in estimated(tmp_path)["peak_board_strain"]["two_scale_how"]


def add_metric(shock: Path, name: str, value: float) -> None:
    """Add a metric to the results of the first model of a shock."""
    path = shock / "two_scale/result.json"
    results = json.loads(path.read_text())
    results["metrics"][name] = metric(value)
    path.write_text(json.dumps(results))


def test_a_figure_that_hardly_changes_has_the_median_error_of_its_family(tmp_path):
    run_with_companions(tmp_path)
    for folder in (tmp_path, *(companion_folder(tmp_path, size_name(size)) for size in SIZES)):
        add_metric(folder / "shock", "peak_displacement@edge", 1e-3)
        add_metric(folder / "shock", "peak_acceleration@edge", 1e3)
    errors = estimated(tmp_path)
    assert errors["peak_displacement@edge"]["discretisation"] == pytest.approx(0.5 * 1.25 * 0.5 / 3.5)
    assert errors["peak_displacement@edge"]["how"].startswith("median of the figures of the board; alone the same")
    assert errors["peak_acceleration@edge"]["discretisation"] == 0.0


def test_a_figure_read_away_from_its_point_says_so(tmp_path):
    run_with_companions(tmp_path)
    path = tmp_path / "shock/two_scale/history.npz"
    with np.load(path) as arrays:
        histories = dict(arrays)
    place = np.array([[0.0175, 0.0, 0.0]])
    np.savez(path, watch=np.array(["edge"]), watch_points=place, **histories)
    assert reading_distances(CASE, path.parent) == {"edge": pytest.approx(5e-4)}
    add_metric(tmp_path / "shock", "peak_strain@edge", 1e-3)
    assert estimated(tmp_path)["peak_strain@edge"]["how"] == "zero, or not in all runs; read 0.5 mm from the point"


def test_two_scales_are_compared_with_one_model_on_the_coarsest_mesh(tmp_path):
    run_with_companions(tmp_path)
    shock_of(companion_folder(tmp_path, COARSEST) / "shock", 2.5, "dns")
    error = estimated(tmp_path)["peak_board_strain"]
    assert error["two_scale"] == pytest.approx(0.2) and error["two_scale_how"] == "one model, elements x 2"


def test_half_the_window_gives_the_error_of_two_scales_without_one_model(tmp_path):
    run_with_companions(tmp_path)
    shock_of(companion_folder(tmp_path, HALF_WINDOW) / "shock", 2.5)
    error = estimated(tmp_path)["peak_board_strain"]
    assert error["two_scale"] == pytest.approx(0.2)
    assert error["two_scale_how"] == "change by half the window without that by coarse parts, elements x 2"


def test_a_missing_companion_leaves_the_errors_unknown(tmp_path):
    shock_of(tmp_path / "shock", 3.5)
    error = estimated(tmp_path)["peel_stress"]
    assert error["how"] == "the run with elements x 2: has not run; the run with elements x 1.5: has not run"
    assert error["two_scale"] is None and error["two_scale_how"] == "the run with elements x 2: has not run"


def test_one_model_on_the_coarsest_mesh_runs_only_where_it_is_cheap(monkeypatch):
    alone = drop('shock.numerics.modes=["two_scale"]')
    half = drop_companions(alone, None)[HALF_WINDOW].shock.numerics
    assert half.step_fraction == 0.5 * CASE.shock.numerics.step_fraction and half.modes == ("two_scale",)
    monkeypatch.setattr("reflowshock.workflow.convergence.drop_companions.CHEAP", 2.0)
    cheap = drop_companions(alone, None)
    assert HALF_WINDOW not in cheap and cheap[COARSEST].shock.numerics.modes == ("two_scale", "dns")
    assert cheap[COARSEST].shock.numerics.dns_duration is None
    assert list(drop_companions(drop('shock.numerics.modes=["dns"]'), None)) == list(map(size_name, SIZES))


def test_sizes_of_a_structure_are_those_of_its_rounded_numbers_of_elements(tmp_path):
    board = structure_sizes(structure("structure.cells=[12, 8]"), tmp_path)
    assert board == {"size_1.5": pytest.approx((1.5 * 1.6) ** 0.5), COARSEST: pytest.approx(2.0)}


STRUCTURE = Path(SMALL_CASE).parent / "structure.toml"
COUPLED = ("dynamics.solver=explicit", "dynamics.modes=0", "dynamics.coupling={fine=['cover']}")


def structure(*settings: str) -> StructureCase:
    """Return the small structure with an error estimate."""
    case = read_case(STRUCTURE, [*ESTIMATE, *settings])
    assert isinstance(case, StructureCase)
    return case


def test_companions_of_a_structure_have_larger_elements_and_one_solver():
    copies = structure_companions(structure("dynamics.numerics.explicit_step=0.05 us"), None)
    for size, copy in zip(SIZES, copies.values(), strict=True):
        assert copy.structure.cells == (round(6 / size), round(4 / size)) and copy.dynamics.solver == "explicit"
        assert copy.structure.layers == structure().structure.layers  # two and one element stay
        assert copy.dynamics.numerics.explicit_step == pytest.approx(0.05e-6 * size)
        assert "errors" not in copy.pipeline.names
    implicit = structure_companions(structure("dynamics.solver=implicit"), None)[COARSEST]
    assert implicit.dynamics.numerics.implicit_step == pytest.approx(2e-6)


def test_two_scales_of_a_structure_need_a_companion_unless_the_run_compares_them():
    coupled = structure_companions(structure(*COUPLED), None)
    assert coupled[HALF_WINDOW].dynamics.numerics.step_fraction == pytest.approx(0.45)
    compared = structure_companions(structure(*COUPLED[:2], "dynamics.coupling={fine=['cover'], compare=true}"), None)
    coupling = compared[COARSEST].dynamics.coupling
    assert HALF_WINDOW not in compared and coupling is not None and not coupling.compare


def test_a_structure_with_an_exact_solution_has_no_companions(tmp_path):
    case = read_case(SMALL_CASE.parents[2] / "cases/cantilever/case.toml")
    assert isinstance(case, StructureCase)
    assert "errors" not in case.pipeline.names and not structure_companions(case, None)
    record_of(tmp_path / "comparison", metrics={"tip_deflection_error": metric(-0.01), "tip_deflection": metric(1.0)})
    assert discretisation(tmp_path, case).record({}) == {
        "tip_deflection_error": {"discretisation": 0.01, "order": None, "two_scale": None, "how": "exact solution"}
    }


def test_one_model_runs_for_half_of_the_time_where_all_of_it_is_too_dear():
    case = read_case(SMALL_CASE.parents[2] / "cases/jedec_bga/case.toml")
    assert isinstance(case, BoardDropCase)
    shock = drop_companions(case, None)[COARSEST].shock
    assert shock.numerics.modes == ("two_scale", "dns")
    assert shock.numerics.dns_duration == pytest.approx(0.5 * float(shock.duration))
