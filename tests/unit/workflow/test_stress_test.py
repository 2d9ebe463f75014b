"""Hard cases: what is read of a file, refused, tried and judged; a hang or a crash is a miss, and the rest goes on."""

import json
import math
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import psutil
import pytest
from hypothesis import given

from reflowshock.cases.hard.bound import read_bound
from reflowshock.cases.hard.collector import HARD
from reflowshock.cases.hard.draws import quantities
from reflowshock.cases.hard.hard_case import hard_case_text, hard_cases, read_hard_cases
from reflowshock.cases.hard.random_cases import read_random_file
from reflowshock.cases.hard.trial import Measured
from reflowshock.cases.hard.trials.coupling import PairRun
from reflowshock.cases.hard.trials.elements import Impact, Turns
from reflowshock.cases.hard.verdict import attempt
from reflowshock.units import UnitError
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.stress_test import command
from reflowshock.workflow.stress_test.command import Request, stress_test
from tests.support.rods import TABLE
from tests.support.workflow_command import wait_until


def cases(**changes):
    """Return the hard cases of a table; ``changes`` replace keys."""
    return hard_cases("elements_rod", TABLE | changes, "elements_rod.toml", None)


def refused(**changes):
    """Return the error message of a table with changes."""
    with pytest.raises(CaseError) as caught:
        cases(**changes)
    return str(caught.value)


def test_margins_are_factors_to_the_bound():
    (case,) = cases()
    verdict = attempt(case)
    assert verdict.ok
    assert [check.margin for check in verdict.checks] == pytest.approx([2.5, 1.5])
    assert [str(check) for check in verdict.checks] == ["error -0.2 % <= 0.5 %", "width 3 mm >= 2 mm"]


@pytest.mark.parametrize("bounds", [{"error": "0.1 %"}, {"width": ["> 2 mm", "< 2.5 mm"]}])
def test_a_value_beyond_its_bound_is_a_miss(bounds):
    (case,) = cases(bounds=bounds)
    assert not attempt(case).ok


def test_every_combination_of_varied_values_is_a_case():
    combinations = cases(vary={"length": ["1 mm", "2 mm"], "fate": ["holds", "raises"]})
    assert [case.tried for case in combinations][:2] == ["length 1 mm, fate holds", "length 1 mm, fate raises"]
    assert [case.parameters.length for case in combinations] == [1e-3, 1e-3, 2e-3, 2e-3]


@pytest.mark.parametrize("fate", ["raises", "is lost"])
def test_errors_and_nan_are_misses(fate):
    (case,) = cases(parameters={"length": "3 mm", "fate": fate})
    assert not attempt(case).ok


def test_no_measure_hides_nan(monkeypatch):
    """The largest of zero and nan is zero to Python: a trial that compares so would survive without a number."""
    from reflowshock.cases.hard.trials import fields, motion, reflow

    energies = np.array([1.0, math.nan, 0.5])
    values = {name: metric.value for name, metric in reflow._energy(energies).items()}
    monkeypatch.setattr(fields, "force_of", lambda term, displacement: np.full_like(displacement, math.nan))
    values["force_error"] = fields.turns(Turns(turns=1, cells=1))["force_error"]
    monkeypatch.setattr(motion, "energies_of", lambda *_: np.outer(energies, np.ones(4)))
    values |= motion.impact(Impact())
    assert all(math.isnan(values[name]) for name in values if name != "plastic_share"), values


@pytest.mark.long
def test_a_push_in_the_middle_of_a_run_counts(monkeypatch):
    from reflowshock.cases.hard.trials import windows

    pushes = iter([0.0] * 100 + [0.5] + [0.0] * 100)
    monkeypatch.setattr(windows, "momentum_change", lambda *_: next(pushes))
    assert windows.run(PairRun(free=True, windows=400, columns=2))["momentum_error"] == 0.5


def test_an_expected_error_is_no_miss_and_its_absence_is():
    fates = {"vary": {"fate": ["raises", "holds"]}, "expect": "the rod broke", "bounds": {}}
    assert [attempt(case).ok for case in cases(**fates)] == [True, False]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trial": "rot"}, "did you mean rod?"),
        ({"family": "reflov"}, "did you mean reflow?"),
        ({"bound": {}}, "did you mean bounds?"),
        ({"bounds": {"eror": "1 %"}}, "did you mean error?"),
        ({"bounds": {"width": "1 kg"}}, "is a mass"),
        ({"bounds": {"error": "1 mm"}}, "is not a pure number"),
        ({"bounds": {"error": 0}}, "must be positive"),
        ({"bounds": {"error": "1e999"}}, "must be finite"),
        ({"bounds": {}}, "nothing is judged"),
        ({"expect": "the rod broke"}, "nothing is measured of a case that must be refused"),
        ({"bounds": {"error": []}}, "bounds.error = []: nothing is judged"),
        ({"parameters": {"lenght": "3 mm"}}, "did you mean length?"),
        ({"parameters": {"length": "-3 mm"}}, 'parameters.length = "-3 mm": is out of range; allowed: > 0 mm'),
        ({"parameters": {"length": 3}}, "needs a unit"),
        ({"vary": {"length": "3 mm"}}, "must be a list"),
    ],
)
def test_errors_in_a_file_are_reported(changes, message):
    assert message in refused(**changes)


def test_an_impossible_run_is_reported_before_it_starts(tmp_path):
    drop = {"case": str(HARD.parent / "sessile_drop/case.toml"), "settings": {"drop": {"volum": "1 mm^3"}}}
    run = {"family": "reflow", "title": "a run", "why": "", "trial": "run", "bounds": {"shape_error": "1 %"}}
    for parameters, message in (({"case": "no.toml"}, "does not exist"), (drop, "did you mean drop.volume?")):
        with pytest.raises(CaseError, match=f"parameters.*{message}"):
            hard_cases("reflow_run", run | {"parameters": parameters}, "reflow_run.toml", tmp_path)


def test_a_measure_that_only_the_run_knows_is_compared_by_its_dimension():
    with pytest.raises(UnitError, match="standoff is in m"):
        read_bound("standoff", "1 kg", None).margin(Measured(1.0, "m"))


@pytest.fixture
def rods(monkeypatch, tmp_path):
    """Write cases of rods to a folder, and have them tried there by processes that know rods."""
    monkeypatch.setenv("PYTEST_PLUGINS", "tests.support.rods")
    monkeypatch.setattr(command, "HARD", tmp_path)

    def attempt_rods(count=0, cores=2, **changes):
        (tmp_path / "elements_rod.toml").write_text(hard_case_text(TABLE | changes))
        survived = stress_test(Request([], ["elements"], count, 1, cores, tmp_path / "out"))
        return survived, json.loads((tmp_path / "out/stress_test.json").read_text())

    return attempt_rods


@pytest.mark.long
def test_hangs_and_deaths_are_misses_and_the_rest_goes_on(rods):
    survived, report = rods(vary={"fate": ["hangs", "dies", "holds"]}, deadline="4 s")
    assert not survived
    assert {record["tried"]: record["message"] for record in report["fixed"]} == {
        "fate hangs": "no answer in 4 s: assumed to hang",
        "fate dies": "the process ended with code 3",
        "fate holds": "",
    }


def test_ctrl_c_ends_a_stress_test_with_a_word(tmp_path):
    cases = [str(HARD / f"remesh_{name}.toml") for name in ("barrel", "tall")]
    line = [sys.executable, "-m", "reflowshock", "stress-test", *cases, "--out", str(tmp_path), "-j", "2"]
    heed = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # a shell lets background jobs ignore it
    process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True, start_new_session=True, preexec_fn=heed)
    wait_until(lambda: len(psutil.Process(process.pid).children()) > 1)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to all that have not left its group
    output = process.communicate(timeout=60)[1]
    assert (process.returncode, output.count("\n")) == (1, 1), output
    assert "interrupted" in output


def test_unwritable_results_are_reported_before_anything_runs(tmp_path):
    case = tmp_path / "elements_rod.toml"
    case.write_text(hard_case_text(TABLE))
    with pytest.raises(CaseError, match="--out"):
        stress_test(Request([case], [], 0, 1, 1, case))


def test_the_same_seed_draws_the_same_cases():
    file = read_random_file(HARD / "remesh_random_bodies.toml")
    first, same, other = ([case.table for case in file.cases(20, seed)] for seed in (3, 3, 4))
    assert first == same != other


RANDOM = {"draws": "rods", "parameters": {}, "bounds": {"width": "< 7 mm"}}


def test_a_random_case_that_misses_is_made_simple_and_is_a_hard_case(rods, tmp_path):
    survived, report = rods(30, cores=1, **RANDOM)
    assert not survived
    (sample,) = report["random"]
    assert sample["tried"] == len(sample["cases"]) == 30
    assert 0 < sum(not case["ok"] for case in sample["cases"]) < 30
    (case,) = read_hard_cases(tmp_path / "out/counterexamples/elements_rod.toml")
    assert 7e-3 < case.parameters.length <= 8e-3
    assert not attempt(case).ok
    assert "30 random ones (seed 1)" in (tmp_path / "out/stress_test.html").read_text()


@pytest.mark.long
def test_refusals_in_words_are_counted_and_too_many_are_a_miss(rods, tmp_path):
    survived, report = rods(5, **RANDOM | {"draws": "refused rods"})
    assert not survived
    assert [report["random"][0][name] for name in ("refused", "ok")] == [5, False]
    assert "0 missed, 1 random trials refused too many" in (tmp_path / "out/stress_test.html").read_text()


def test_pytest_collects_the_first_case_of_each_file():
    line = [sys.executable, "-m", "pytest", "-m", "", "--collect-only", str(HARD)]
    output = subprocess.run(line, capture_output=True, text=True, cwd=HARD.parents[1], check=True, timeout=120).stdout
    fixed = [path.stem for path in HARD.glob("*.toml") if read_random_file(path) is None]
    assert sorted(Path(line.split("::")[0]).stem for line in output.splitlines() if "::" in line) == sorted(fixed)


def test_all_cases_of_the_program_can_be_read():
    files = [(path, read_random_file(path)) for path in sorted(HARD.glob("*.toml"))]
    all_cases = [case for path, random in files for case in (random.cases(2, 1) if random else read_hard_cases(path))]
    assert all(case.name.split("_")[0] == case.family for case in all_cases)


@given(quantities(-30.0, 30.0, "deg"))
def test_drawn_values_are_zero_or_distinguishable_from_it(quantity):
    value = float(quantity.removesuffix(" deg"))
    assert value == 0.0 or abs(value) > 1e-5
