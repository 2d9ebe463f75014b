"""Rows of an interrupted benchmark are kept, and discarded when the program has changed."""

import pytest

from benchmarks.support import stored_rows
from benchmarks.support.stored_rows import StoredRows


def test_rows_are_computed_once(tmp_path):
    path, computed = tmp_path / "build" / "rows.jsonl", []

    def compute(value: int) -> int:
        computed.append(value)
        return value

    for _ in range(2):
        rows = StoredRows(path, "one_point")
        assert [rows.get(f"pair {k}", lambda k=k: compute(k)) for k in range(3)] == [0, 1, 2]
    assert computed == [0, 1, 2]
    assert StoredRows(path, "modes").get("pair 0", lambda: compute(7)) == 7


def test_a_row_that_was_being_written_is_computed_again(tmp_path):
    path = tmp_path / "rows.jsonl"
    StoredRows(path, "").get("first", lambda: 1)
    StoredRows(path, "").get("second", lambda: 2)
    path.write_text(path.read_text()[:-5])
    rows = StoredRows(path, "")
    assert rows.get("first", lambda: pytest.fail("it was kept")) == 1
    assert rows.get("second", lambda: 3) == 3
    assert StoredRows(path, "").get("second", lambda: pytest.fail("it was kept")) == 3


def test_rows_of_other_sources_do_not_count(tmp_path, monkeypatch):
    StoredRows(tmp_path / "rows.jsonl", "").get("first", lambda: 1)
    monkeypatch.setattr(stored_rows, "SOURCES", stored_rows.SOURCES[:1])
    assert StoredRows(tmp_path / "rows.jsonl", "").get("first", lambda: 2) == 2
