"""Run folders and studies are cleaned of the program's files only."""

import pytest

from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.jobs.batch import show_products
from reflowshock.workflow.process.error_exit import LOG, LOGS
from reflowshock.workflow.run import clean
from reflowshock.workflow.store import view
from reflowshock.workflow.store.folders import lock_folder, remove_program_files
from reflowshock.workflow.store.state import examine
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.store.view import remove_all_links, remove_unused
from tests.support.products import OTHER, POINT, make, shown_run

NAMES = POINT.case.pipeline.names


@pytest.fixture
def store(tmp_path):
    """Return the store of a run folder that shows all products."""
    return shown_run(tmp_path / "run")


def test_all_is_removed_where_nothing_is_a_users(store, monkeypatch):
    remove_all_links(store)
    assert remove_program_files(store.folder) == []
    assert not store.folder.exists()
    store.folder.mkdir()
    monkeypatch.chdir(store.folder)
    assert remove_program_files(store.folder) == []
    assert store.folder.is_dir()


def test_a_store_that_is_a_link_is_not_followed(store, tmp_path):
    precious = tmp_path / "precious"
    store.home.rename(precious)
    store.home.symlink_to(precious)
    with pytest.raises(CaseError, match="is a link"):
        remove_program_files(store.folder)
    assert precious.is_dir()


def test_unused_products_can_be_removed(store):
    make(store, OTHER, ("shock", "report"))
    (store.home / "work/reflow-0/reflow").mkdir(parents=True)
    assert remove_unused(store) == (2, 1)
    assert not any(state.stale for state in examine(store, POINT).values())


def test_what_is_unused_is_counted_apart_from_unfinished_work(store, capsys):
    make(store, OTHER, ("shock", "report"))
    (store.home / "work/reflow-0/reflow").mkdir(parents=True)
    clean(store.folder, "small", unused=True)
    clean(store.folder, "small", unused=True)
    first, second = capsys.readouterr().out.replace("\n", " ").split("removed")[1:]
    assert first.startswith(" 2 unused products and 1 unfinished stage from")
    assert second.startswith(" 0 unused products from")


def test_details_of_errors_are_the_programs_own(store):
    logs = store.folder / LOGS
    logs.mkdir()
    (logs / f"{LOG}x1.txt").write_text("Traceback")
    clean(store.folder, "small")
    assert not store.folder.exists()


def test_a_users_logs_stay(store):
    logs = store.folder / LOGS
    logs.mkdir()
    for name in (f"{LOG}x1.txt", "mine.txt"):
        (logs / name).write_text("text")
    clean(store.folder, "small")
    assert [path.relative_to(store.folder).as_posix() for path in store.folder.rglob("*")] == ["logs", "logs/mine.txt"]


@pytest.fixture
def study(tmp_path):
    """The folder of a study of two points, with a table of its own; one of them was also repeated for its times."""
    study = Store(tmp_path / "study")
    with lock_folder(study.folder, "study", "pads"):
        for member, points in ((study, (POINT, OTHER)), (study.repeated[0], (POINT,))):
            for point in points:
                make(member, point, NAMES)
                show_products(member, point)
        made = study.home / "work/report"
        made.mkdir(parents=True)
        (made / "results.csv").write_text("")
        view.adopt(study, study.folder, made)
    return study


def test_a_study_is_cleaned_as_a_whole_with_force_only(study):
    with pytest.raises(CaseError, match=r"contains the study of pads, not the run of small.*--force"):
        clean(study.folder, "small")
    assert (study.folder / "results.csv").exists()
    clean(study.folder, "small", force=True)
    assert not study.folder.exists()


def test_a_users_files_in_a_study_stay(study):
    note = study.folder / "points" / POINT.key / "notes.txt"
    note.write_text("mine")
    clean(study.folder, "small", force=True)
    assert [path for path in study.folder.rglob("*") if path.is_file()] == [note]


def test_a_study_stays_one_when_its_unused_products_are_removed(study):
    (study.home / "work/reflow-0").mkdir()
    clean(study.folder, "small", unused=True, force=True)
    with lock_folder(study.folder, "study", "pads"):
        assert not any(state.stale for point in (POINT, OTHER) for state in examine(study, point).values())
