"""Rows of a long benchmark stay when it is broken off, and only as long as they are those of the present program."""

import pytest

from benchmarks.support import kept_rows
from benchmarks.support.kept_rows import KeptRows


def test_rows_are_computed_once(tmp_path):
    path, computed = tmp_path / "build" / "rows.jsonl", []

    def compute(value: int) -> int:
        computed.append(value)
        return value

    for _ in range(2):
        rows = KeptRows(path, "one_point")
        assert [rows.found(f"pair {k}", lambda k=k: compute(k)) for k in range(3)] == [0, 1, 2]
    assert computed == [0, 1, 2]
    assert KeptRows(path, "modes").found("pair 0", lambda: compute(7)) == 7


def test_a_row_that_was_being_written_is_computed_again(tmp_path):
    path = tmp_path / "rows.jsonl"
    KeptRows(path, "").found("first", lambda: 1)
    KeptRows(path, "").found("second", lambda: 2)
    path.write_text(path.read_text()[:-5])
    rows = KeptRows(path, "")
    assert rows.found("first", lambda: pytest.fail("it was kept")) == 1
    assert rows.found("second", lambda: 3) == 3
    assert KeptRows(path, "").found("second", lambda: pytest.fail("it was kept")) == 3


def test_rows_of_other_sources_do_not_count(tmp_path, monkeypatch):
    KeptRows(tmp_path / "rows.jsonl", "").found("first", lambda: 1)
    monkeypatch.setattr(kept_rows, "SOURCES", kept_rows.SOURCES[:1])
    assert KeptRows(tmp_path / "rows.jsonl", "").found("first", lambda: 2) == 2
