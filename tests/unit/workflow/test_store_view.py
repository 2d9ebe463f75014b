"""Run folders: they show products by name and preserve files of the user."""

import fcntl
import os
import shutil

import pytest

from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.jobs.batch import show_products
from reflowshock.workflow.store import view
from reflowshock.workflow.store.folders import RunFolderBusy, lock_folder, remove_program_files
from reflowshock.workflow.store.product import discard
from reflowshock.workflow.store.state import examine
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.store.view import altered_files, remove_all_links, remove_unused
from tests.support.products import OTHER, POINT, make, shown_run

NAMES = POINT.case.pipeline.names


@pytest.fixture
def store(tmp_path):
    """Return the store of a run folder that shows all products."""
    return shown_run(tmp_path / "run")


def test_products_have_the_names_that_users_know(store):
    for stage in POINT.case.pipeline.stages:
        assert all((store.folder / name).is_file() for name in (*stage.products, stage.record))
    assert (store.folder / "report.html").read_text() == "report/report.html"
    assert (store.folder / "summary.json").samefile(store.product(POINT, "report") / "summary.json")


@pytest.mark.parametrize("lost", ["report.html", "reflow/shapes.h5", "surface"])
def test_what_is_lost_is_put_back(store, lost):
    path = store.folder / lost
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    assert show_products(store, POINT)
    assert path.exists()
    assert show_products(store, POINT) == []


def test_a_run_folder_shows_no_product_of_other_parameters(store):
    show_products(store, OTHER)
    assert (store.folder / "geometry/assembly.msh").exists()
    assert not any((store.folder / name).exists() for name in ("report.html", "report", "summary.json", "shock"))
    show_products(store, POINT)
    assert (store.folder / "report.html").exists()


@pytest.mark.parametrize("harm", ["", "{", "[1]", '{"report.html": 1}'])
def test_where_the_list_is_lost_products_are_recognised(store, harm):
    (store.folder / "notes.txt").write_text("mine")
    (store.home / "views/run.json").write_text(harm)
    show_products(store, OTHER)
    assert (store.folder / "geometry/assembly.msh").exists() and (store.folder / "notes.txt").exists()
    assert not any((store.folder / name).exists() for name in ("report.html", "report", "summary.json", "shock"))


def test_files_of_a_user_stay(store):
    mine = [store.folder / "notes.txt", store.folder / "shock/notes.txt"]
    for path in mine:
        path.write_text("mine")
    (store.folder / "report.html").unlink()
    (store.folder / "report.html").write_text("mine, too")
    show_products(store, POINT)
    assert (store.folder / "report.html").read_text() == "report/report.html"
    assert (store.folder / "report.html.kept-1").read_text() == "mine, too"
    show_products(store, OTHER)
    remove_all_links(store)
    assert remove_program_files(store.folder) == ["notes.txt", "report.html.kept-1", "shock"]
    assert all(path.read_text() == "mine" for path in mine)


def test_what_a_user_writes_into_a_product_is_set_aside(store):
    """Some editors keep the file, and write into the product with it."""
    (store.folder / "summary.json").write_text("mine")
    show_products(store, POINT)
    assert not (store.folder / "report.html").exists()
    assert (store.folder / "summary.json.kept-1").read_text() == "mine"
    make(store, POINT, ["report"])
    assert show_products(store, POINT) == []
    assert (store.folder / "summary.json").read_text() == "report/summary.json"
    assert (store.folder / "summary.json.kept-1").read_text() == "mine"


@pytest.mark.parametrize("clean", [True, False])
def test_copies_behind_a_link_are_a_users(store, tmp_path, clean):
    copy = shutil.copytree(store.folder / "shock", tmp_path / "copy")
    (copy / "notes.txt").write_text("mine")
    before = sorted(path.name for path in copy.iterdir())
    shutil.rmtree(store.folder / "shock")
    (store.folder / "shock").symlink_to(copy)
    if clean:
        remove_all_links(store)
        assert remove_program_files(store.folder) == ["shock"]
    else:
        assert show_products(store, POINT) == ["shock/stage.json"]
        assert (store.folder / "shock.kept-1").is_symlink() and not (store.folder / "shock").is_symlink()
    assert sorted(path.name for path in copy.iterdir()) == before


def test_a_run_folder_may_be_a_link(store, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(store.folder)
    (store.folder / "report.html").unlink()
    linked = Store(link, one_run=True)
    assert show_products(linked, POINT) == ["report.html"]
    assert link.is_symlink() and (store.folder / "report.html").is_file()


def test_obsolete_links_are_removed_before_their_list_entries(store, monkeypatch):
    """However early the program is killed, no old product is mistaken for a user's file."""

    def kill(*_: object) -> None:
        raise KeyboardInterrupt

    make(store, POINT, ["report"], content=" again")
    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(view, "_write_list", kill)
        show_products(store, POINT)
    assert not (store.folder / "report.html").exists()
    show_products(store, POINT)
    assert (store.folder / "report.html").read_text() == "report/report.html again"
    assert not list(store.folder.rglob("*.kept-*"))


def test_foreign_files_do_not_replace_files_of_a_user(store):
    def adopted(text: str, *names: str) -> None:
        made = store.home / "work/made"
        made.mkdir(parents=True)
        for name in names:
            (made / name).write_text(text)
        view.adopt(store, store.folder, made)
        made.rmdir()

    (store.folder / "results.csv").write_text("mine")
    adopted("first", "results.csv", "picture.png")
    assert (store.folder / "results.csv.kept-1").read_text() == "mine"
    (store.folder / "results.csv").write_text("mine, too")
    adopted("second", "results.csv")
    assert (store.folder / "results.csv").read_text() == "second"
    assert (store.folder / "results.csv.kept-2").read_text() == "mine, too"
    assert not (store.folder / "picture.png").exists() and (store.folder / "report.html").exists()
    adopted("third", "results.csv")
    assert len(list(store.folder.glob("results.csv*"))) == 3
    assert show_products(store, POINT) == [] and not (store.folder / "results.csv").exists()


@pytest.mark.parametrize("harm", ["", None])
def test_copies_of_a_user_stay_where_the_list_is_lost(store, harm):
    mine = store.folder / "monday.html"
    mine.write_bytes((store.folder / "report.html").read_bytes())
    names = store.home / "views/run.json"
    names.unlink() if harm is None else names.write_text(harm)
    assert remove_unused(store) == (0, 0)
    show_products(store, OTHER)
    assert mine.read_text() == "report/report.html" and not (store.folder / "report.html").exists()


def test_a_users_inputs_are_set_aside_or_left(store, tmp_path):
    shutil.rmtree(store.folder / "inputs")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/case.json").write_text("mine")
    (store.folder / "inputs").symlink_to(tmp_path / "mine")
    remove_all_links(store)
    assert (tmp_path / "mine/case.json").read_text() == "mine"
    show_products(store, POINT)
    assert (store.folder / "inputs.kept-1").is_symlink() and (store.folder / "inputs/case.json").is_file()
    assert (tmp_path / "mine/case.json").read_text() == "mine"


@pytest.mark.parametrize("place", ["product", "work", "partial", "link"])
@pytest.mark.parametrize("kind", ["file", "link", "folder"])
def test_whatever_stands_where_a_product_is_made_gives_way(store, tmp_path, place, kind):
    product, work = store.product(POINT, "surface"), store.work_folder(POINT, "surface")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/notes.txt").write_text("mine")
    path = {"product": product, "work": work, "partial": work / ".surface.partial", "link": work / "reflow"}[place]
    discard(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    if kind == "file":
        path.write_text("?")
    elif kind == "link":
        path.symlink_to(tmp_path / "mine")
    else:
        shutil.copytree(tmp_path / "mine", path)
    make(store, POINT, ["surface"])
    assert not any(state.stale for state in examine(store, POINT).values())
    assert not product.is_symlink()
    assert [file.name for file in (tmp_path / "mine").iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("name", [".store", ".store/products", ".store/work", ".store/views"])
def test_a_file_where_a_folder_of_the_store_belongs_gives_way(store, name):
    discard(store.folder / name)
    (store.folder / name).write_text("?")
    with lock_folder(store.folder, "run", "small"):
        for stage in NAMES:
            if not store.has(POINT, stage):
                make(store, POINT, [stage])
        show_products(store, POINT)
    assert not any(state.stale for state in examine(store, POINT).values())
    assert altered_files(store, store.folder) == []


def test_a_folder_where_the_list_belongs_gives_way(store):
    names = store.home / "views/run.json"
    names.unlink()
    names.mkdir()
    assert show_products(store, POINT) == []
    assert names.is_file()


def test_a_file_where_a_folder_belongs_is_set_aside(store):
    shutil.rmtree(store.folder / "reflow")
    (store.folder / "reflow").write_text("mine")
    show_products(store, POINT)
    assert (store.folder / "reflow/shapes.h5").is_file()
    assert (store.folder / "reflow.kept-1").read_text() == "mine"


def test_without_hard_links_products_are_copied(store, monkeypatch):
    def refuse(*_: object) -> None:
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", refuse)
    (store.folder / "report.html").unlink()
    assert show_products(store, POINT) == ["report.html"]
    assert not (store.folder / "report.html").samefile(store.product(POINT, "report") / "report.html")
    assert show_products(store, POINT) == []
    (store.folder / "report.html").write_text("bits")
    assert show_products(store, POINT) == ["report.html"]


def test_a_copy_of_a_run_folder_is_one(store, tmp_path):
    copy = Store(shutil.copytree(store.folder, tmp_path / "copy"), one_run=True)
    assert show_products(copy, POINT) == []
    assert not any(state.stale for state in examine(copy, POINT).values())


@pytest.mark.parametrize(("what", "name"), [("run", "other"), ("study", "small")])
def test_another_case_needs_force(store, what, name):
    with pytest.raises(CaseError, match=r"contains the run of small.*--force"), lock_folder(store.folder, what, name):
        pass
    with lock_folder(store.folder, what, name, force=True):
        pass
    with lock_folder(store.folder, what, name):
        pass


@pytest.mark.parametrize(
    ("names", "words"), [(["notes.txt"], "files that the program did not write"), (["inputs", ".snakemake"], "earlier")]
)
def test_a_folder_of_somebody_else_is_left_alone(tmp_path, names, words):
    for name in names:
        (tmp_path / name).mkdir()
    for force in (False, True):
        with pytest.raises(CaseError, match=words), lock_folder(tmp_path, "run", "small", force):
            pass
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)


def test_no_run_folder_is_made_in_a_store(store):
    folder = store.home / "products/mine"
    with pytest.raises(CaseError, match=r"is inside \.store"), lock_folder(folder, "run", "small"):
        pass
    assert not folder.exists()


def test_an_unfinished_mark_is_not_a_file_of_a_user(tmp_path):
    (tmp_path / ".reflowshock.partial").write_text("{")
    with lock_folder(tmp_path, "run", "small"):
        pass
    assert remove_program_files(tmp_path) == []


def test_missing_files_of_the_run_folder_are_reported(store):
    assert altered_files(store, store.folder) == []
    (store.folder / "report.html").unlink()
    (store.folder / "summary.json").unlink()
    (store.folder / "summary.json").write_text("mine")
    differences = altered_files(store, store.folder)
    assert sorted(line.removeprefix(f"{store.folder}/") for line in differences) == [
        "report.html is missing",
        "summary.json was modified",
    ]
    show_products(store, POINT)
    assert altered_files(store, store.folder) == []


def test_a_run_folder_has_one_user(tmp_path):
    first, second = lock_folder(tmp_path, "run", "a"), lock_folder(tmp_path, "run", "a")
    with first, pytest.raises(RunFolderBusy, match="another run is active"), second:
        pass
    with lock_folder(tmp_path, "run", "a"):
        pass


def test_a_removed_lock_does_not_lock(tmp_path, monkeypatch):
    """As when a folder is cleaned between the opening of its lock and the holding of it."""
    folder, take = tmp_path / "run", fcntl.flock

    def clean_first(descriptor: int, how: int) -> None:
        (folder / ".lock").unlink()
        take(descriptor, how)

    monkeypatch.setattr(fcntl, "flock", clean_first)
    with pytest.raises(RunFolderBusy, match="try again"), lock_folder(folder, "run", "a"):
        pass


@pytest.mark.parametrize("make_it", [lambda path: path.touch(), lambda path: path.symlink_to(path)])
def test_paths_that_are_not_folders_are_rejected(tmp_path, make_it):
    make_it(tmp_path / "file")
    with pytest.raises(CaseError, match=r"is not a folder|cannot be used"), lock_folder(tmp_path / "file", "run", "a"):
        pass
