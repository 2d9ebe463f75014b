"""The verdict on a drop: limits of joints, margins, life; the deciding criterion; the answer in one line."""

import json

import numpy as np
import pytest

from reflowshock.fem.problem.failure import Failure
from reflowshock.parameters import with_value
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.verdict.answer import answer, criteria_table, failing
from reflowshock.workflow.verdict.criteria import CRITERIA
from reflowshock.workflow.verdict.criterion import FAIL, NO_LIMIT, PASS, JudgedDrop
from reflowshock.workflow.verdict.verdict import verdict_of, verdict_of_structure
from tests.support.workflow_command import SMALL_CASE

CASE = read_case(SMALL_CASE)
HISTORY = {
    "time": np.array([0.0, 1e-3, 2e-3, 3e-3, 4e-3]),
    "joints": np.array(["A1", "A2"]),
    "board_centre": np.outer([0.0, -1e-4, 2e-4, 1e-4, 0.0], [0.0, 0.0, 1.0]),
    "peel_board": np.array([[0.0, 0.0], [5e6, -9e6], [1e6, 1e6], [0.0, 0.0], [0.0, 0.0]]),
    "peel_package": np.array([[0.0, 0.0], [6e6, 2e6], [1e6, 8e6], [0.0, 0.0], [0.0, 0.0]]),
    "von_mises_board": np.array([[0.0, 0.0], [1e7, 1e7], [1e7, 1e7], [0.0, 0.0], [0.0, 0.0]]),
    "von_mises_package": np.array([[0.0, 0.0], [1e7, 2e7], [1e7, 1e7], [0.0, 0.0], [0.0, 0.0]]),
    "plastic_work_board": np.array([[0.0, 0.0], [1e3, 2e3], [1e3, 4e3], [1e3, 4e3], [1e3, 4e3]]),
    "plastic_work_package": np.array([[0.0, 0.0], [2e3, 1e3], [3e3, 1e3], [3e3, 1e3], [3e3, 1e3]]),
}
LIFE = {"measure": "peel_stress", "constant": 5120.0, "exponent": 3.0, "scatter": 2.0, "source": "ten boards"}
OFF = {"board_deflection": {"apply": "off"}}


def dropped(failure, history=HISTORY, metrics=None, reference=None, coarse=()):
    """Return a drop to be judged, from its criteria of failure and its results."""
    case = with_value(CASE, "shock.failure", Failure.model_validate(failure))
    return JudgedDrop(case, metrics or {}, history, coarse, reference)


def judged(life=None, coarse=(), history=HISTORY, **limits):
    """Return the verdict on a drop with limits by criterion."""
    limits_with_source = {name: {"limit": limit, "source": "a test"} for name, limit in limits.items()}
    failure = OFF | limits_with_source | ({} if life is None else {"life": life})
    return verdict_of(dropped(failure, history, coarse=coarse))


def of(verdict, name):
    """Return the record of a criterion in a verdict."""
    return next(record for record in verdict["criteria"] if record["name"] == name)


def test_without_a_criterion_there_is_no_verdict():
    verdict = judged()
    assert (verdict["design"], verdict["criterion"], verdict["joint"]) == (NO_LIMIT, None, "A2")
    assert not any(record["applies"] for record in verdict["criteria"])
    assert all(record["why"] and record["limit"] is record["margin"] is None for record in verdict["criteria"])
    assert verdict["joints"]["A2"] == {
        "criterion": "peel_stress", "value": 8e6, "limit": None, "margin": None, "verdict": NO_LIMIT
    }  # fmt: skip
    assert answer(verdict, None, "off") == "A2: peel 8 MPa, NO LIMIT; discretisation unknown (off)"


def test_tension_counts_at_either_pad_and_any_time_and_compression_does_not():
    verdict = judged(peel_stress=7e6)
    assert {name: joint["value"] for name, joint in verdict["joints"].items()} == {"A1": 6e6, "A2": 8e6}
    assert [joint["verdict"] for joint in verdict["joints"].values()] == [PASS, FAIL]
    assert (verdict["design"], verdict["criterion"], verdict["joint"]) == (FAIL, "peel_stress", "A2")
    assert answer(verdict, 0.04) == "A2: peel 8 MPa of 7 (margin 0.88), FAIL; discretisation ±4 %"


def test_a_limit_that_is_just_met_holds():
    verdict = judged(peel_stress=8e6)
    assert (verdict["design"], verdict["joints"]["A2"]["margin"]) == (PASS, 1.0)


def test_the_criterion_of_least_margin_decides():
    verdict = judged(peel_stress=16e6, layer_von_mises=30e6, layer_plastic_work=2.5e3)
    joint_verdicts = verdict["joints"]
    assert {name: joint["criterion"] for name, joint in joint_verdicts.items()} == dict.fromkeys(
        ("A1", "A2"), "layer_plastic_work"
    )
    assert [joint["margin"] for joint in joint_verdicts.values()] == pytest.approx([2.5 / 3.0, 2.5 / 4.0])
    assert joint_verdicts["A1"]["source"] == "a test"
    assert verdict["criterion"] == "layer_plastic_work"
    assert of(verdict, "layer_plastic_work")["margin"] == pytest.approx(2.5 / 4.0)


def test_a_joint_that_is_only_pressed_holds_without_a_margin():
    pressed = {name: 0.0 - np.abs(values) if "peel" in name else values for name, values in HISTORY.items()}
    verdict = judged(history=pressed, peel_stress=1e6)
    assert verdict["joints"]["A1"] == {
        "criterion": "peel_stress", "value": 0.0, "limit": 1e6, "margin": None, "verdict": PASS, "source": "a test"
    }  # fmt: skip
    assert answer(verdict, None).startswith("A2: peel 0 MPa of 1, PASS;")


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
    assert not of(verdict, "life")["applies"] and "required is not given" in of(verdict, "life")["why"]


LIFE_OF_A2 = {
    "joint": "A2", "measure": "peel_stress", "value": 8e6, "source": "ten boards",
    "drops": pytest.approx(10.0), "least": pytest.approx(5.0), "most": pytest.approx(20.0),
}  # fmt: skip


@pytest.mark.parametrize(("required", "design", "margin"), [(4, PASS, 1.25), (10, FAIL, 0.5)])
def test_the_lower_end_of_the_scatter_must_reach_the_required_drops(required, design, margin):
    verdict = judged(life=LIFE | {"required": required})
    assert (verdict["design"], verdict["criterion"]) == (design, "life")
    assert of(verdict, "life")["margin"] == pytest.approx(margin)
    assert answer(verdict, None).startswith(f"life of A2 5 of {required} (margin {margin:.2g}), {design}; A2: peel 8")


def test_a_joint_that_is_never_loaded_lives_for_ever():
    pressed = {name: 0.0 * values if "peel" in name else values for name, values in HISTORY.items()}
    verdict = judged(life=LIFE | {"required": 10}, history=pressed)
    assert (verdict["design"], of(verdict, "life")["value"]) == (PASS, None)
    assert "unlimited of 10, PASS" in answer(verdict, None)


def test_the_worst_of_all_criteria_decides():
    limits = {"peel_stress": {"limit": 16e6, "source": "pull tests"}, "board_strain": {"limit": 5e-4, "source": "us"}}
    metrics = {"peak_board_strain": {"value": 4e-4, "unit": ""}}
    verdict = verdict_of(dropped(limits, metrics=metrics))
    margins = {record["name"]: record["margin"] for record in verdict["criteria"] if record["applies"]}
    assert set(margins) == {"peel_stress", "board_strain", "board_deflection"}
    assert (verdict["design"], verdict["criterion"]) == (PASS, min(margins, key=margins.get)) == (PASS, "board_strain")
    assert answer(verdict, 0.03) == (
        "board strain 400 µm/m of 500 (margin 1.2), PASS; A2: peel 8 MPa of 16 (margin 2); discretisation ±3 %"
    )
    table = criteria_table(verdict)
    assert [row[0] for row in table["rows"]] == ["board strain", "peel of A2", "board deflection"]
    assert "von Mises (needs shock.failure.layer_von_mises.limit)" in table["note"]
    assert "Steinberg" in table["rows"][2][-1] and table["rows"][0][-1] == "us"


def test_each_criterion_has_a_formula_and_a_range_and_the_program_names_its_source():
    assert len({criterion.name for criterion in CRITERIA}) == len(CRITERIA)
    assert all(criterion.words and criterion.formula and criterion.valid for criterion in CRITERIA)
    applying = [record for record in verdict_of(dropped({}))["criteria"] if record["applies"]]
    assert [record["name"] for record in applying] == ["board_deflection"] and applying[0]["source"]


def test_the_strain_criterion_says_why_the_standard_is_left_out():
    assert "IPC/JEDEC-9704 is left out" in of(judged(), "board_strain")["why"]


def test_a_structure_is_not_judged_and_says_why():
    verdict = verdict_of_structure()
    assert (verdict["design"], verdict["joints"]) == (NO_LIMIT, {})
    assert not verdict["criteria"][0]["applies"] and "component" in verdict["criteria"][0]["why"]


def test_verdicts_are_written_as_json():
    verdict = json.loads(json.dumps(judged(peel_stress=7e6, life=LIFE)))
    assert verdict["design"] == FAIL
    contract = {"name", "value", "limit", "unit", "margin", "source", "applies", "why"}
    assert all(contract <= set(record) for record in verdict["criteria"])


def test_a_limit_of_strain_has_a_unit_and_a_source():
    text = 'shock.failure.board_strain={ limit = "500 um/m", source = "maker of the package" }'
    assert read_case(SMALL_CASE, [text]).shock.failure.board_strain.limit == pytest.approx(5e-4)
    with pytest.raises(CaseError, match=r"board_strain\.limit"):
        read_case(SMALL_CASE, [text.replace(" um/m", " mm")])
    with pytest.raises(CaseError, match=r"board_strain\.source.*is missing"):
        read_case(SMALL_CASE, ['shock.failure.board_strain={ limit = "500 um/m" }'])
