"""The verdict on a drop: three kinds, margins, life; the answer; and how a run with each of them ends."""

import json

import numpy as np
import pytest

from reflowshock.fem.problem.failure import Failure
from reflowshock.workflow.package.verdict import FAIL, NO_LIMIT, PASS, answer, failing, limits_table, verdict_of

HISTORY = {
    "joints": np.array(["A1", "A2"]),
    "peel_board": np.array([[0.0, 0.0], [5e6, -9e6], [1e6, 1e6]]),
    "peel_package": np.array([[0.0, 0.0], [6e6, 2e6], [1e6, 8e6]]),
    "von_mises_board": np.array([[0.0, 0.0], [1e7, 1e7], [1e7, 1e7]]),
    "von_mises_package": np.array([[0.0, 0.0], [1e7, 2e7], [1e7, 1e7]]),
    "plastic_work_board": np.array([[0.0, 0.0], [1e3, 2e3], [1e3, 4e3]]),
    "plastic_work_package": np.array([[0.0, 0.0], [2e3, 1e3], [3e3, 1e3]]),
}
LIFE = {"measure": "peel_stress", "constant": 5120.0, "exponent": 3.0, "scatter": 2.0, "source": "ten boards"}


def judged(life=None, coarse=(), history=HISTORY, **limits):
    limits_with_source = {name: {"limit": limit, "source": "a test"} for name, limit in limits.items()}
    failure = Failure.model_validate(limits_with_source | ({} if life is None else {"life": life}))
    return verdict_of(failure, history, "A1", coarse)


def test_without_a_limit_there_is_no_verdict():
    verdict = judged()
    assert (verdict["design"], verdict["joint"]) == (NO_LIMIT, "A1")
    assert verdict["joints"]["A2"] == {
        "criterion": "peel_stress", "value": 8e6, "limit": None, "margin": None, "verdict": NO_LIMIT
    }  # fmt: skip
    assert answer(verdict, None) == "A1: peel 6 MPa, NO LIMIT; discretisation not known, run reflowshock accuracy"


def test_tension_counts_at_either_pad_and_any_time_and_compression_does_not():
    verdict = judged(peel_stress=7e6)
    assert {name: joint["value"] for name, joint in verdict["joints"].items()} == {"A1": 6e6, "A2": 8e6}
    assert [joint["verdict"] for joint in verdict["joints"].values()] == [PASS, FAIL]
    assert (verdict["design"], verdict["joint"]) == (FAIL, "A2")
    assert answer(verdict, 0.04) == "A2: peel 8 MPa of 7 (margin 0.88), FAIL; discretisation ±4 %"


def test_a_limit_that_is_just_met_holds():
    verdict = judged(peel_stress=8e6)
    assert (verdict["design"], verdict["joints"]["A2"]["margin"]) == (PASS, 1.0)


def test_the_criterion_of_least_margin_decides():
    joint_verdicts = judged(peel_stress=16e6, layer_von_mises=30e6, layer_plastic_work=2.5e3)["joints"]
    assert {name: joint["criterion"] for name, joint in joint_verdicts.items()} == dict.fromkeys(
        ("A1", "A2"), "layer_plastic_work"
    )
    assert [joint["margin"] for joint in joint_verdicts.values()] == pytest.approx([2.5 / 3.0, 2.5 / 4.0])
    assert joint_verdicts["A1"]["source"] == "a test"


def test_a_joint_that_is_only_pressed_holds_without_a_margin():
    pressed = {name: 0.0 - np.abs(values) if "peel" in name else values for name, values in HISTORY.items()}
    verdict = judged(history=pressed, peel_stress=1e6)
    assert verdict["joints"]["A1"] == {
        "criterion": "peel_stress", "value": 0.0, "limit": 1e6, "margin": None, "verdict": PASS, "source": "a test"
    }  # fmt: skip
    assert answer(verdict, None).startswith("A1: peel 0 MPa of 1, PASS;")


def test_joints_that_fail_are_named_the_worst_first():
    assert failing(judged(peel_stress=7e6)) == "1 of 2 joints in the model fails: A2."
    assert failing(judged(peel_stress=1e6)) == "2 of 2 joints in the model fail: A2, A1."
    assert failing(judged(peel_stress=1e9)) == failing(judged()) == ""
    many = {f"A{k}": {"verdict": FAIL, "margin": k / 20} for k in range(1, 16)}
    assert failing({"joints": many}).endswith(" A11, A12, and 3 more.")


def test_values_of_coarse_joints_are_marked():
    assert [joint.get("mesh") for joint in judged(coarse=["A2"])["joints"].values()] == [None, "coarse"]


def test_life_belongs_to_the_joint_that_fails_first_with_its_scatter():
    verdict = judged(life=LIFE)
    assert verdict["life"] == LIFE_OF_A2
    assert "NO LIMIT; life of A2 10 drops (5 to 20); discretisation" in answer(verdict, None)


LIFE_OF_A2 = {
    "joint": "A2", "measure": "peel_stress", "value": 8e6, "source": "ten boards",
    "drops": pytest.approx(10.0), "least": pytest.approx(5.0), "most": pytest.approx(20.0),
}  # fmt: skip


def test_each_limit_is_printed_with_its_source():
    limits = {"peel_stress": {"limit": 8e7, "source": "pull tests"}, "life": LIFE}
    assert limits_table(Failure.model_validate(limits))["rows"] == [
        ["peel stress", "80 MPa", "pull tests"],
        ["life by peel stress", "N = 5120 s^-3, scatter factor 2", "ten boards"],
    ]
    assert limits_table(Failure()) is None


def test_verdicts_are_written_as_json():
    assert json.loads(json.dumps(judged(peel_stress=7e6, life=LIFE)))["design"] == FAIL
