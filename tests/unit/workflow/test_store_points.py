"""Points: what their products depend on, which are missing, what is said of those that cannot be."""

import pytest

from reflowshock.workflow.jobs.batch import failure_message, list_missing, log_of, show_products
from reflowshock.workflow.pipeline.points import PointsError, read_possible_points
from reflowshock.workflow.store.state import examine
from reflowshock.workflow.store.store import MESSAGE, Store
from tests.support.products import make
from tests.support.workflow_command import SMALL_CASE

HEATED = {"warpage.corner": "0 mm", "thermal.steps": "2"}


def digests(settings: dict[str, str]) -> dict[str, str]:
    """Return stage -> digest of its parameters, for the shortened case with settings."""
    return dict(read_possible_points(SMALL_CASE, [settings])[0][0].digests)


@pytest.mark.parametrize(
    ("settings", "changed"),
    [
        ({"case.name": "other"}, {"report"}),
        ({"shock.peak_acceleration": "1000 G"}, {"shock", "report"}),
        ({"shock.identical_joints": "true"}, {"solder_mesh", "shock", "report"}),
        ({"board.thickness": "1.1 mm"}, {"geometry", "solder_mesh", "shock", "report"}),
        ({"solder.volume": "0.07 mm^3"}, {"reflow", "surface", "solder_mesh", "shock", "report"}),
        ({"package.pitch": "0.9 mm"}, {"geometry", "reflow", "surface", "solder_mesh", "shock", "report"}),
        ({"shock.peak_acceleration": "1.5 kG"}, set()),
    ],
)
def test_a_digest_changes_with_what_a_product_depends_on(settings, changed):
    before, after = digests({}), digests(settings)
    assert {stage for stage in before if before[stage] != after[stage]} == changed


def test_where_the_solder_freezes_changes_the_reflow_and_what_cools_from_there_only_the_shock():
    before, after = digests(HEATED), digests(HEATED | {"thermal.final": "0 degC"})
    assert {stage for stage in before if before[stage] != after[stage]} == {"shock", "report"}
    after = digests(HEATED | {"board.thickness": "1.1 mm"})
    assert before["reflow"] != after["reflow"]


def test_another_version_makes_other_products(monkeypatch):
    before = digests({})
    monkeypatch.setattr("reflowshock.workflow.store.keys.__version__", "0")
    assert not set(before.values()) & set(digests({}).values())


def test_a_shared_product_is_missing_once(tmp_path):
    store = Store(tmp_path)
    settings = [{}, {"shock.peak_acceleration": "1000 G"}, {"solder.volume": "0.07 mm^3"}]
    points = read_possible_points(SMALL_CASE, settings)[0]
    jobs = list_missing(store, points, "report")
    count = {stage: sum(job.stage == stage for job in jobs) for stage in points[0].case.pipeline.names}
    assert count == {"geometry": 1, "reflow": 2, "surface": 2, "solder_mesh": 2, "shock": 3, "report": 3}
    make(store, points[0], ["geometry", "reflow"])
    assert [job.stage for job in list_missing(store, points[:2], "solder_mesh")] == ["surface", "solder_mesh"]
    assert list_missing(store, points[:1], "surface")[0].needs == ()
    assert not store.is_complete(points[0], "surface")
    assert store.is_complete(points[0], "reflow")


def test_a_point_has_a_run_folder_as_any_other(tmp_path):
    store, point = Store(tmp_path), read_possible_points(SMALL_CASE, [{}])[0][0]
    make(store, point, ["geometry"])
    show_products(store, point)
    assert (store.run_folder(point) / "geometry/assembly.msh").samefile(
        store.product(point, "geometry") / "assembly.msh"
    )
    states = examine(store, point)
    assert not states["geometry"].stale
    assert states["reflow"].missing


def test_the_reason_of_an_incomplete_point_is_reported(tmp_path):
    store, point = Store(tmp_path), read_possible_points(SMALL_CASE, [{}])[0][0]
    make(store, point, ["geometry"])
    assert failure_message(store, point, "geometry") == ""
    assert failure_message(store, point, "report") == "stage reflow: was not started"
    log = log_of(store, point, "reflow")
    log.parent.mkdir(parents=True)
    log.write_text("some words\nKilled\n")
    assert (
        f'stage reflow: ended without an error message (it may have been killed); last output: "Killed"; see {log}'
        == (failure_message(store, point, "report"))
    )
    message = store.work_folder(point, "reflow") / ".reflow.partial" / MESSAGE
    message.parent.mkdir(parents=True)
    message.write_text("it broke")
    assert failure_message(store, point, "report") == "stage reflow: it broke"
    store.prepare_work(point, "reflow")
    assert store.message(point, "reflow") is None


def test_all_errors_of_points_are_reported_with_their_settings():
    settings = [{}, {"package.pitch": "0.1 mm"}, {"package.pitsch": "1 mm", "solder.volume": "1 mm"}]
    points, impossible = read_possible_points(SMALL_CASE, settings)
    lines = PointsError("study.toml", impossible, settings).lines()
    assert (len(points), set(impossible)) == (1, {1, 2})
    assert lines[0].startswith("study.toml: point 2 (package.pitch = 0.1 mm): ")
    third = [line for line in lines if line.startswith("study.toml: point 3 (package.pitsch = 1 mm, ")]
    assert "did you mean package.pitch?" in third[0] + third[1]
    assert any("solder.volume" in line.partition(")")[2] for line in third)
