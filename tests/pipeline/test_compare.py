"""Comparison of runs in the terminal and in a page, and rejected arguments."""

import json
import shutil

import numpy as np
import pytest

from tests.support.warm_start import warm_command


@pytest.fixture
def two_runs(run_folder, tmp_path):
    """Return the run folder of the shortened case and a copy of it."""
    return run_folder, shutil.copytree(run_folder, tmp_path / "other")


def compare(*arguments):
    """Run the command ``compare`` with arguments; return the completed process."""
    return warm_command("compare", *map(str, arguments))


def test_copy_of_a_run_is_equal(two_runs):
    done = compare(*two_runs)
    assert done.returncode == 0, done.stderr
    assert "all parameters are equal" in done.stdout and "all results are equal" in done.stdout


def test_different_results_are_printed_with_their_change(two_runs, tmp_path):
    first, other = two_runs
    summary = json.loads((other / "summary.json").read_text())
    summary["metrics"]["peel_stress"]["value"] *= 1.25
    (other / "summary.json").unlink()
    (other / "summary.json").write_text(json.dumps(summary))
    history = other / "shock/two_scale/history.npz"
    with np.load(history) as arrays:
        changed = dict(arrays) | {
            "peel_board": 2.0 * arrays["peel_board"],
            "peel_package": 2.0 * arrays["peel_package"],
        }
    history.unlink()
    np.savez(history, **changed)
    page = tmp_path / "compare.html"
    done = compare(first, other, "--out", page)
    assert done.returncode == 0, done.stderr
    assert "peel stress" in done.stdout and "(+25 %)" in done.stdout and "all parameters are equal" in done.stdout
    ratio = next(line for line in done.stdout.splitlines() if "peel stress relative to" in line)
    assert "1.25" in ratio
    text = page.read_text()
    assert "(+25 %)" in text and "(+100 %)" in text and text.count("data-figure=") == 1
    assert compare(first, other, "--out", page).returncode == 0  # a page of this command is overwritten


def test_incomparable_runs_are_rejected(two_runs, drop_folder, tmp_path):
    first, other = two_runs
    for arguments, words in (
        ((first,), "requires two or more run folders"),
        ((first, first), "is given twice"),
        ((first, tmp_path), "is not a run folder"),
        ((first, drop_folder), "is a run of kind [drop], but small is of kind [package]"),
        ((first, other, "--out", tmp_path / "no/page.html"), "does not exist"),
    ):
        done = compare(*arguments)
        assert done.returncode == 2 and words in done.stderr, (arguments, done.stderr)
    mine = tmp_path / "mine.html"
    mine.write_text("mine")
    done = compare(first, other, "--out", mine)
    assert done.returncode == 2 and "was not written by reflowshock compare" in done.stderr
    assert mine.read_text() == "mine"
