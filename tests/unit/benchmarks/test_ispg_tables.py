"""Rows of the tables of the scheme ispg: the program accepts each of them, and takes that scheme."""

import pytest

from benchmarks import ispg_tables
from benchmarks.ispg_tables import ROOT, TABLES
from benchmarks.support import results
from reflowshock.workflow.pipeline.reader import read_case


@pytest.mark.parametrize("table", TABLES)
def test_rows_are_accepted(table):
    rows = TABLES[table]
    assert len({row.name for row in rows}) == len(rows)
    for row in rows:
        case = read_case(ROOT / "cases" / row.case / "case.toml", row.settings)
        assert case.molten.numerics.scheme == "ispg"


def test_rows_are_computed_once(tmp_path, monkeypatch):
    """A row that is refused is stored as such."""
    asked, refused = [], ispg_tables.drop(16, 60)
    monkeypatch.setattr(results, "FOLDER", tmp_path)
    monkeypatch.setattr(ispg_tables, "TABLES", {"drops": [refused], "free": []})
    monkeypatch.setattr(ispg_tables, "warm_up", lambda: asked.append("warm"))
    for arguments in ([], ["drops"], ["drops", "--again"]):
        monkeypatch.setattr("sys.argv", ["ispg_tables.py", *arguments])
        ispg_tables.main()
    assert asked == ["warm"] * 2
    assert "16 particles along an edge" in results.read_figures(ispg_tables.NAME)["drops"][refused.name]["error"]
