"""Runs side by side: what differs in parameters and answers, on the terminal and in a page; what is refused."""

import json
import shutil

import numpy as np
import pytest

from tests.support.warm_start import warm_command


@pytest.fixture
def two_runs(run_folder, tmp_path):
    """The run folder of the shortened case, and a copy of it."""
    return run_folder, shutil.copytree(run_folder, tmp_path / "other")


def compare(*arguments):
    return warm_command("compare", *map(str, arguments))


def test_a_run_is_like_itself(two_runs):
    done = compare(*two_runs)
    assert done.returncode == 0, done.stderr
    assert "all parameters are the same" in done.stdout and "all answers are the same" in done.stdout


def test_answers_that_differ_are_told_with_their_change(two_runs, tmp_path):
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
    assert "peel stress" in done.stdout and "(+25 %)" in done.stdout and "all parameters are the same" in done.stdout
    text = page.read_text()
    assert "(+25 %)" in text and "(+100 %)" in text and text.count("data-figure=") == 1
    assert compare(first, other, "--out", page).returncode == 0  # its own page it writes again


def test_what_cannot_be_compared_is_refused(two_runs, drop_folder, tmp_path):
    first, other = two_runs
    for arguments, words in (
        ((first,), "needs two or more run folders"),
        ((first, first), "is given twice"),
        ((first, tmp_path), "is not a run folder"),
        ((first, drop_folder), "is a run of another kind of case, [drop], than small, [package]"),
        ((first, other, "--out", tmp_path / "no/page.html"), "there is no folder"),
    ):
        done = compare(*arguments)
        assert done.returncode == 2 and words in done.stderr, (arguments, done.stderr)
    mine = tmp_path / "mine.html"
    mine.write_text("mine")
    done = compare(first, other, "--out", mine)
    assert done.returncode == 2 and "was not written by reflowshock compare" in done.stderr
    assert mine.read_text() == "mine"
