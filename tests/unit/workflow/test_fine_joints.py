"""Which joints are fine: the keys of a case, what is said about wrong ones, and the critical ones of a history."""

import numpy as np
import pytest

from reflowshock.parameters import with_value
from reflowshock.workflow.board_drop.fine_joints import (
    FineJoints,
    most_stressed,
    needs_coarse_joints,
    read_fine_joints,
    write_fine_joints,
)
from reflowshock.workflow.board_drop.shock_effects import of_joint_meshes
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.pipeline.template import case_text
from tests.support.workflow_command import SMALL_CASE

FAULTS = {
    "shock.coupling.fine_joints=['A9']": ("is not a joint of the model", "A3 to B4", "did you mean A4?"),
    "shock.coupling.fine_joints=['a3']": ("is not a joint of the model", "did you mean A3?"),
    "shock.coupling.fine_joints=['D1']": ("a quarter that is not modelled", "did you mean A4?"),
    "shock.coupling.fine_joints=['d1']": ("a quarter that is not modelled", "did you mean A4?"),
    "shock.coupling.fine_joints=[]": ("leaves the meso model empty", "at least one name"),
    "shock.coupling.fine_joints='criticl'": ("all, critical, or a list of names", "did you mean critical?"),
    "shock.coupling.fine_joints=[3]": ("shock.coupling.fine_joints = [3]", "a list of names"),
    "shock.coupling.levels=0": ("shock.coupling.levels = 0", "auto, or >= 1"),
    "shock.coupling.critical_joints=0": ("out of range", ">= 1"),
}


@pytest.mark.parametrize("setting", FAULTS)
def test_wrong_choices_are_said(setting):
    with pytest.raises(CaseError) as error:
        read_case(SMALL_CASE, [setting])
    text = str(error.value)
    assert [word for word in FAULTS[setting] if word not in text] == [], text


def test_more_critical_joints_than_joints_are_refused():
    with pytest.raises(
        CaseError, match=r"critical_joints = 5: is more than the number of joints in the model; allowed: 1 to 4"
    ):
        read_case(SMALL_CASE, ["shock.coupling.fine_joints=critical", "shock.coupling.critical_joints=5"])


def test_levels_are_refused_where_the_scheme_has_none():
    with pytest.raises(CaseError, match=r"levels = 2: cannot be combined with scheme = impulse; allowed: auto"):
        read_case(SMALL_CASE, ["shock.coupling.scheme=impulse", "shock.coupling.levels=2"])


def test_a_new_case_shows_what_the_keys_take():
    text = case_text(read_case(SMALL_CASE), "small")
    lines = {line.split(" = ")[0]: line for line in text.splitlines()}
    assert "all, critical, or a list of names" in lines["fine_joints"]
    assert "auto, or >= 1" in lines["levels"]


@pytest.mark.parametrize(
    ("chosen", "direction", "needed"),
    [("all", "two_way", False), ("critical", "two_way", True), (("A3",), "two_way", True), ("all", "one_way", True)],
)
def test_coarse_joints_are_an_effect_of_what_is_not_fine(chosen, direction, needed):
    parameters = {"fine_joints": chosen, "direction": direction}
    case = read_case(SMALL_CASE)
    coupling = case.shock.coupling.model_copy(update=parameters)
    assert needs_coarse_joints(coupling) is needed
    effect = of_joint_meshes(with_value(case, "shock.coupling", coupling))["coarse_joints"]
    assert effect["on"] is needed
    assert effect["why"]


def test_the_most_stressed_joints_are_those_of_the_highest_peel_at_either_pad(tmp_path):
    board = np.array([[1.0, 9.0, 3.0], [2.0, 1.0, 3.0]]) * 1e6
    package = np.array([[1.0, 1.0, 3.0], [10.0, 1.0, 4.0]]) * 1e6
    path = tmp_path / "history.npz"
    np.savez(path, joints=np.array(["A1", "A2", "A3"]), peel_board=board, peel_package=package)
    fine = most_stressed(path, 2)
    assert fine.names == ("A1", "A2")
    assert "most stressed of 3 by peel stress" in fine.why
    assert "A1 10 MPa, A2 9 MPa; the next is A3 4 MPa" in fine.why
    assert most_stressed(path, 3).why.endswith("A3 4 MPa")


def test_joints_that_yield_rank_by_their_plastic_work(tmp_path):
    peel, work = np.array([[9e6, 1e6, 8e6]]), np.array([[1e3, 5e3, 0.0]])
    ends = {f"peel_{end}": peel for end in ("board", "package")}
    ends |= {f"plastic_work_{end}": work for end in ("board", "package")}
    np.savez(tmp_path / "history.npz", joints=np.array(["A1", "A2", "A3"]), **ends)
    fine = most_stressed(tmp_path / "history.npz", 1)
    assert fine.names == ("A2",)
    assert "by plastic work density of the layer" in fine.why
    assert "A2 5 kJ/m³; the next is A1" in fine.why


@pytest.mark.parametrize("names", ["all", ("A3", "B4")])
def test_what_was_chosen_can_be_read_again(tmp_path, names):
    assert read_fine_joints(tmp_path) is None
    write_fine_joints(tmp_path, FineJoints(names, "so"))
    assert read_fine_joints(tmp_path) == FineJoints(names, "so")
