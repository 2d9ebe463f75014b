"""The comparison of the results of two systems or checkouts: what it counts as a difference."""

import json

import numpy as np
import pytest

from tests.same_results import EVERY_CASE, ROOT, compare, compare_exactly


def test_every_case_is_compared():
    cases = {str(path.relative_to(ROOT)) for path in (ROOT / "cases").glob("*/case.toml")}
    assert cases <= {path for path, _ in EVERY_CASE.values()}


def write_results(folder, value, array):
    """Write a summary with one metric, and a history with one array."""
    folder.mkdir(parents=True)
    (folder / "summary.json").write_text(json.dumps({"metrics": {"height": {"value": value, "unit": "m"}}}))
    np.savez(folder / "history.npz", height=array)


@pytest.mark.parametrize(("other", "count"), [(1.0 + 1e-7, 0), (1.0 + 1e-5, 1), (float("nan"), 1)])
def test_numbers_that_are_apart_are_counted(tmp_path, other, count):
    for system, value in (("first", 1.0), ("second", other)):
        write_results(tmp_path / system / "drop", value, [value])
    assert compare(tmp_path / "first", tmp_path / "second", ["drop"]) == count


@pytest.mark.parametrize(("other", "count"), [([1.0, 2.0], 0), ([1.0, 2.0 + 1e-15], 1), ([1.0], 1)])
def test_arrays_of_two_checkouts_are_equal_to_the_bit(tmp_path, other, count):
    for checkout, array in (("first", [1.0, 2.0]), ("second", other)):
        write_results(tmp_path / checkout / "drop", 1.0, array)
    assert compare_exactly(tmp_path / "first", tmp_path / "second", ["drop"]) == count
