"""The comparison of results of two systems: what it counts as a difference."""

import json

import pytest

from tests.both_systems import compare


@pytest.mark.parametrize(("other", "count"), [(1.0 + 1e-7, 0), (1.0 + 1e-5, 1), (float("nan"), 1)])
def test_numbers_that_are_apart_are_counted(tmp_path, other, count):
    for system, value in (("first", 1.0), ("second", other)):
        folder = tmp_path / system / "drop"
        folder.mkdir(parents=True)
        (folder / "summary.json").write_text(json.dumps({"metrics": {"height": {"value": value, "unit": "m"}}}))
    assert compare(tmp_path / "first", tmp_path / "second", ["drop"]) == count
