"""Progress that a second terminal reads."""

import json

import pytest

from reflowshock.workflow.process import progress_file
from reflowshock.workflow.process.progress_file import progress_writer, read_progress, write_progress_to
from reflowshock.workflow.process.terminal import progress_bar
from reflowshock.workflow.store.folders import is_busy, lock_folder


@pytest.fixture(autouse=True)
def told(monkeypatch, tmp_path):
    """Let progress be written to a temporary folder."""
    monkeypatch.setenv(progress_file.VARIABLE, "")
    write_progress_to(tmp_path)


def test_a_bar_is_seen_from_elsewhere(tmp_path, monkeypatch):
    monkeypatch.setattr(progress_file, "INTERVAL", 0.0)
    with progress_bar("shock") as bar:
        assert read_progress(tmp_path).share == 0.0
        assert read_progress(tmp_path).left is None
        bar(0.25, "shock, first half")
    progress = read_progress(tmp_path)
    assert (progress.what, progress.share) == ("shock, first half", 0.25)
    assert progress.left == pytest.approx(3.0 * progress.seconds)


def test_it_is_not_written_more_often_than_looked_at(tmp_path):
    tell = progress_writer("shock")
    tell(0.5, "")
    assert read_progress(tmp_path).share == 0.0


@pytest.mark.parametrize(
    "text", ["", "[]", "{", json.dumps({"what": "a"}), json.dumps({"what": 1, "share": "x", "begin": 0})]
)
def test_a_damaged_file_is_no_progress(tmp_path, text):
    (tmp_path / progress_file.NAME).write_text(text)
    assert read_progress(tmp_path) is None


def test_a_place_that_cannot_be_written_is_no_reason_to_end(tmp_path, monkeypatch):
    monkeypatch.setenv(progress_file.VARIABLE, str(tmp_path / "gone" / "progress.json"))
    progress_writer("shock")(0.5, "")
    assert read_progress(tmp_path / "gone") is None


def test_a_folder_is_busy_while_somebody_works_in_it(tmp_path):
    folder = tmp_path / "run"
    assert not is_busy(folder)
    with lock_folder(folder, "run", "mine"):
        assert is_busy(folder)
    assert not is_busy(folder)
