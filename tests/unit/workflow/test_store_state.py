"""Staleness by content: parameters, what was read, and the files themselves."""

import pytest

from reflowshock.workflow.case.fields import leaves
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.run import Findings
from reflowshock.workflow.jobs.batch import list_missing, show_products
from reflowshock.workflow.package.case import BOARD_DROP
from reflowshock.workflow.pipeline.points import read_case_of_run
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.store.keys import compare, stage_inputs
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.state import examine, failed_checks
from reflowshock.workflow.store.store import CASE, Store
from tests.support.products import make
from tests.support.workflow_command import SMALL_CASE, WHO_COMPUTES

NAMES = BOARD_DROP.names
AFTER = {name: NAMES[NAMES.index(name) :] for name in NAMES}
RERUN = {
    "shock.peak_acceleration=1000 G": ("shock", "report"),
    "shock.pulse_duration=1 ms": ("shock", "report"),
    "materials.die.young_modulus=130 GPa": ("shock", "report"),
    "materials.solder.young_modulus=40 GPa": AFTER["solder_mesh"],
    "solder.surface_tension=0.5 N/m": AFTER["reflow"],
    "warpage.corner=0.03 mm": AFTER["reflow"],
    "package.joint_numerics.layers=8": AFTER["solder_mesh"],
    "package.die.thickness=0.3 mm": ("geometry", "solder_mesh", "shock", "report"),
    "board.numerics.coarse_size=4 mm": ("geometry", "solder_mesh", "shock", "report"),
    "case.title=Another": ("report",),
    "shock.ranks.total=1": (),
    "shock.failure.board_deflection.component=leadless": ("report",),
}


def point_of(*settings: str) -> Point:
    """Return the point of the shortened case with settings."""
    return Point({}, read_case(SMALL_CASE, settings))


@pytest.fixture
def store(tmp_path):
    """Return the store of an empty run folder."""
    return Store(tmp_path / "run", one_run=True)


@pytest.fixture
def done(store):
    """A store with all products of the case, shown in its run folder."""
    make(store, point_of(), NAMES)
    show_products(store, point_of())
    return store


def stale(store: Store, point: Point) -> tuple[str, ...]:
    """Return the names of the stages that are not up to date."""
    return tuple(name for name, state in examine(store, point).items() if state.stale)


def test_every_parameter_belongs_to_a_stage():
    case = read_case(SMALL_CASE)
    used = {key for stage in BOARD_DROP.stages for key in stage_inputs(case, stage)}
    assert {key for key, _, _ in leaves(case)} == used | WHO_COMPUTES
    assert not used & WHO_COMPUTES


def test_nothing_was_run(store):
    assert stale(store, point_of()) == NAMES
    assert all(state.missing for state in examine(store, point_of()).values())


def test_all_is_up_to_date(done):
    assert stale(done, point_of()) == ()
    assert read_case_of_run(done.folder) == point_of().case


@pytest.mark.parametrize(("setting", "names"), RERUN.items(), ids=RERUN.keys())
def test_only_what_depends_on_a_value_is_stale(done, setting, names):
    assert stale(done, point_of(setting)) == names


def test_the_changed_key_is_named(done):
    states = examine(done, point_of("shock.peak_acceleration=1000 G"))
    (change,) = states["shock"].changes
    assert change.key == "shock.peak_acceleration"
    assert (change.old, change.new) == pytest.approx((14709.975, 9806.65))
    assert states["report"].because_of == ("shock",)


def test_a_value_that_returns_finds_its_products(done):
    other = point_of("shock.peak_acceleration=1000 G")
    make(done, other, ("shock", "report"))
    show_products(done, other)
    assert stale(done, other) == stale(done, point_of()) == ()


def test_a_lost_product_is_made_again_and_what_follows_only_if_it_comes_out_otherwise(done):
    point = point_of()
    lost = done.product(point, "solder_mesh") / "joints.msh"
    lost.unlink()
    states = examine(done, point)
    assert stale(done, point) == ("solder_mesh",)
    assert states["solder_mesh"].damaged == ("joints.msh is missing",)
    assert states["shock"].because_of == ("solder_mesh",)
    make(done, point, ["solder_mesh"])
    assert stale(done, point) == ()
    lost.unlink()
    make(done, point, ["solder_mesh"], content=", otherwise")
    assert stale(done, point) == ("shock", "report")
    assert [job.stage for job in list_missing(done, [point], "report")] == ["shock", "report"]


def test_a_geometry_with_the_same_pads_is_not_read_by_the_reflow(done):
    point = point_of()
    (done.product(point, "geometry") / "assembly.msh").write_text("bits")
    assert stale(done, point) == ("geometry",)
    assert not examine(done, point)["reflow"].because_of


@pytest.mark.parametrize("harm", ["", "{", '{"files": {}}', "[]", "null"])
def test_a_damaged_record_is_noticed(done, harm):
    point = point_of()
    (done.product(point, "reflow") / "stage.json").write_text(harm)
    assert examine(done, point)["reflow"].damaged == ("stage.json was modified",)
    assert failed_checks(done, point, "reflow") == ["reflow: its product is missing or damaged"]


def test_a_number_that_was_changed_in_a_record_is_noticed(done):
    point = point_of()
    path = done.product(point, "reflow") / "stage.json"
    path.write_text(path.read_text().replace('"continued": ""', '"continued": "x"'))
    assert stale(done, point) == ("reflow",)


def test_a_check_that_failed_is_named(store):
    check = {"volume_error": {"value": 0.2, "limit": 0.1, "ok": False}}
    make(store, point_of(), ["geometry"])
    make(store, point_of(), ["reflow"], findings=Findings(health=check))
    assert failed_checks(store, point_of(), "reflow") == ["reflow: volume error 0.2, limit 0.1"]
    assert failed_checks(store, point_of(), "geometry") == []


def test_a_damaged_case_of_a_run_is_reported(done):
    path = done.folder / CASE
    path.write_text(path.read_text().replace('"small"', '"smell"'))
    with pytest.raises(CaseError, match="was changed since it was written"):
        read_case_of_run(done.folder)
    path.unlink()
    with pytest.raises(CaseError, match="is not a run folder"):
        read_case_of_run(done.folder)


def test_compare_names_new_changed_and_lost_keys():
    changes = compare({"a": 1, "b": 2, "c": 3}, {"a": 1, "b": 5, "d": 4})
    assert [(change.key, change.old, change.new) for change in changes] == [
        ("b", 2, 5), ("d", None, 4), ("c", 3, None),
    ]  # fmt: skip
