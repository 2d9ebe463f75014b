"""Hard cases: what is read of a file, refused, tried and judged; a hang or a crash is a miss, and the rest goes on."""

import dataclasses
import json
import math
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from functools import partial
from typing import Annotated

import numpy as np
import psutil
import pytest
from hypothesis import strategies as st
from pydantic import Field

from reflowshock.cases.hard.trials.elements import Impact, PairRun, Turns
from reflowshock.parameters import Parameters
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.units import UnitError
from reflowshock.workflow.stress_test import families, hard_case, sample
from reflowshock.workflow.stress_test.bound import read_bound
from reflowshock.workflow.stress_test.case_file import hard_case_text
from reflowshock.workflow.stress_test.command import HARD, Request, stress_test
from reflowshock.workflow.stress_test.hard_case import hard_cases, read_hard_cases
from reflowshock.workflow.stress_test.pool import Pool
from reflowshock.workflow.stress_test.random_cases import drawn
from reflowshock.workflow.stress_test.random_trial import RandomTrial, quantities
from reflowshock.workflow.stress_test.results import write_results
from reflowshock.workflow.stress_test.sample import try_sample
from reflowshock.workflow.stress_test.trial import Measured, Refused, Trial
from reflowshock.workflow.stress_test.verdict import attempt
from tests.support.workflow_command import wait_until


class Rod(Parameters):
    """A rod that is stretched."""

    length: Annotated[float, "mm"] = Field(gt=0)
    fate: str = "holds"


def stretch(rod: Rod) -> dict[str, Measured]:
    """Do what the rod's fate is."""
    if rod.fate == "hangs":
        time.sleep(60.0)
    if rod.fate == "dies":
        os._exit(3)
    if rod.fate == "raises":
        raise ArithmeticError("the rod broke")
    error = math.nan if rod.fate == "is lost" else -2e-3
    return {"error": Measured(100.0 * error, "%"), "width": Measured(1e3 * rod.length, "mm")}


ROD = Trial(Rod, stretch, {"error": "", "width": "mm"})


@pytest.fixture(autouse=True)
def rods(monkeypatch):
    monkeypatch.setattr(hard_case, "trials", lambda: {"rod": ROD})


TABLE = {
    "family": "elements",
    "title": "a rod",
    "why": "rods break",
    "trial": "rod",
    "parameters": {"length": "3 mm"},
    "bounds": {"error": "0.5 %", "width": "> 2 mm"},
}


def cases(**changes):
    return hard_cases("elements_rod", TABLE | changes, "elements_rod.toml", None)


def refused(**changes):
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
    found = cases(vary={"length": ["1 mm", "2 mm"], "fate": ["holds", "raises"]})
    assert [case.tried for case in found][:2] == ["length 1 mm, fate holds", "length 1 mm, fate raises"]
    assert [case.parameters.length for case in found] == [1e-3, 1e-3, 2e-3, 2e-3]


@pytest.mark.parametrize("fate", ["raises", "is lost"])
def test_errors_and_nan_are_misses(fate):
    (case,) = cases(parameters={"length": "3 mm", "fate": fate})
    assert not attempt(case).ok


def test_no_measure_hides_nan(monkeypatch):
    """The largest of zero and nan is zero to Python: a trial that compares so would survive without a number."""
    from reflowshock.cases.hard.trials import fields, motion, reflow

    energies = np.array([1.0, math.nan, 0.5])
    told = {name: found.value for name, found in reflow._energy(energies).items()}
    monkeypatch.setattr(fields, "force_of", lambda term, displacement: np.full_like(displacement, math.nan))
    told["force_error"] = fields.turns(Turns(turns=1, cells=1))["force_error"]
    monkeypatch.setattr(motion, "march", lambda *_: np.outer(energies, np.ones(4)))
    told |= motion.impact(Impact())
    assert all(math.isnan(told[name]) for name in told if name != "plastic_share"), told


def test_a_push_in_the_middle_of_a_run_counts(monkeypatch):
    from reflowshock.cases.hard.trials import windows

    pushes = iter([0.0] * 100 + [0.5] + [0.0] * 100)
    monkeypatch.setattr(windows, "momentum_change", lambda *_: next(pushes))
    assert windows.run(PairRun(free=True, windows=400, columns=2))["momentum_error"] == 0.5


def test_an_expected_error_is_no_miss_and_its_absence_is():
    fates = {"vary": {"fate": ["raises", "holds"]}, "expect": "the rod broke", "bounds": {}}
    assert [attempt(case).ok for case in cases(**fates)] == [True, False]


@pytest.mark.parametrize(
    ("changes", "told"),
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
def test_what_is_wrong_in_a_file_is_told(changes, told):
    assert told in refused(**changes)


def test_a_run_that_cannot_be_is_told_before_it_is_tried(monkeypatch, tmp_path):
    monkeypatch.setattr(hard_case, "trials", families.trials)
    drop = {"case": str(HARD.parent / "sessile_drop/case.toml"), "settings": {"drop": {"volum": "1 mm^3"}}}
    run = {"family": "reflow", "title": "a run", "why": "", "trial": "run", "bounds": {"shape_error": "1 %"}}
    for parameters, told in (({"case": "no.toml"}, "there is no such file"), (drop, "did you mean drop.volume?")):
        with pytest.raises(CaseError, match=f"parameters.*{told}"):
            hard_cases("reflow_run", run | {"parameters": parameters}, "reflow_run.toml", tmp_path)


def test_a_measure_that_only_the_run_knows_is_compared_by_its_dimension():
    with pytest.raises(UnitError, match="standoff is in m"):
        read_bound("standoff", "1 kg", None).margin(Measured(1.0, "m"))


def test_hangs_and_deaths_are_misses_and_the_rest_goes_on():
    found = cases(vary={"fate": ["hangs", "dies", "holds"]}, deadline="4 s")
    with Pool(2) as pool:
        verdicts = {verdict.case.tried: verdict for verdict in pool.attempt(found)}
    assert verdicts["fate hangs"].message == "no answer in 4 s: taken to hang"
    assert verdicts["fate dies"].message == "the process ended with code 3"
    assert verdicts["fate holds"].ok


def test_ctrl_c_ends_a_stress_test_with_a_word(tmp_path):
    line = [
        sys.executable,
        "-m",
        "reflowshock",
        "stress-test",
        "--family",
        "coupling",
        "--out",
        str(tmp_path),
        "-j",
        "2",
    ]
    heed = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # a shell lets background jobs ignore it
    process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True, start_new_session=True, preexec_fn=heed)
    wait_until(lambda: len(psutil.Process(process.pid).children()) > 1)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to all that have not left its group
    told = process.communicate(timeout=60)[1]
    assert (process.returncode, told.count("\n")) == (1, 1), told
    assert "interrupted" in told


def test_results_that_cannot_be_written_are_told_before_anything_is_tried(tmp_path):
    case = tmp_path / "elements_rod.toml"
    case.write_text(hard_case_text(TABLE))
    with pytest.raises(CaseError, match="--out"):
        stress_test(Request([case], [], 0, 1, 1, case))


def test_a_process_that_ended_between_two_cases_is_replaced():
    with Pool(1) as pool:
        for _ in range(2):
            (verdict,) = pool.attempt(cases())
            assert verdict.ok, verdict.message
            for child in multiprocessing.active_children():
                child.kill()
                child.join()


@pytest.fixture
def rods_of_any_length(monkeypatch):
    """A random trial whose rods miss when they are longer than 7 mm."""
    tables = st.fixed_dictionaries({"length": quantities(1.0, 10.0, "mm")})
    trial = RandomTrial("elements_random", "rods", "none grows", "rod", tables, {"width": "< 7 mm"})
    monkeypatch.setattr(sample, "random_trials", lambda family: [trial])
    return trial


class PoolHere:
    """Tries in this process."""

    def attempt(self, cases):
        return map(attempt, cases)


def test_the_same_seed_draws_the_same_cases(rods_of_any_length):
    assert drawn(rods_of_any_length, 20, 3) == drawn(rods_of_any_length, 20, 3) != drawn(rods_of_any_length, 20, 4)


def test_a_random_case_that_misses_is_made_simple_and_is_a_hard_case(rods_of_any_length, tmp_path, monkeypatch):
    (found,) = try_sample("elements", 30, 1, PoolHere())
    assert len(found.verdicts) == 30
    assert 0 < len(found.missed) < 30
    write_results(tmp_path, [attempt(case) for case in cases()], [found], 1)
    (case,) = read_hard_cases(tmp_path / "counterexamples/elements_random.toml")
    assert 7e-3 < case.parameters.length <= 8e-3
    assert not attempt(case).ok
    told = json.loads((tmp_path / "stress_test.json").read_text())
    assert [len(told["fixed"]), told["random"][0]["tried"]] == [1, 30]
    assert "30 random ones (seed 1)" in (tmp_path / "stress_test.html").read_text()


def test_refusals_in_words_are_counted_and_too_many_are_a_miss(rods_of_any_length, monkeypatch, tmp_path):
    def refuse(rod):
        raise Refused("no such rod")

    monkeypatch.setattr(hard_case, "trials", lambda: {"rod": dataclasses.replace(ROD, run=refuse)})
    (found,) = try_sample("elements", 5, 1, PoolHere())
    assert (found.refused, found.missed, found.ok) == (5, [], False)
    write_results(tmp_path, [], [found], 1)
    assert "0 missed, 1 random trials refused too many" in (tmp_path / "stress_test.html").read_text()


def test_all_cases_of_the_program_can_be_read(monkeypatch):
    monkeypatch.setattr(hard_case, "trials", families.trials)
    found = [case for path in sorted(HARD.glob("*.toml")) for case in read_hard_cases(path)]
    assert all(case.name.split("_")[0] == case.family for case in found)
