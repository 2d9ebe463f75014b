"""Failure criteria judge only what has a limit, at either end of a joint and at any time."""

from types import SimpleNamespace

import numpy as np
import pytest

from reflowshock.effect import decided
from reflowshock.fem.estimates.drop_effects import Failing
from reflowshock.fem.estimates.material_effects import MATERIAL_EFFECTS
from reflowshock.fem.materials.library import SAC305, SILICON, SNPB
from reflowshock.fem.materials.roles import Materials
from reflowshock.fem.output.failure import failed_joints, failure_criteria, judge, worst
from reflowshock.fem.problem.shock import Failure

HISTORY = {
    "joints": np.array(["A1", "A2"]),
    "peel_board": np.array([[0.0, 0.0], [5e6, -9e6], [1e6, 1e6]]),
    "peel_package": np.array([[0.0, 0.0], [6e6, 2e6], [1e6, 8e6]]),
    "plastic_work_board": np.array([[0.0, 0.0], [1e3, 2e3], [1e3, 4e3]]),
    "plastic_work_package": np.array([[0.0, 0.0], [2e3, 1e3], [3e3, 1e3]]),
}


def test_without_limits_nothing_is_judged():
    assert failure_criteria(Failure()) == []
    assert judge([], HISTORY) == {}
    assert Failing.by_limits(Failure()) == {"on": False, "why": "shock.failure gives no limit"}


def test_tension_counts_compression_does_not():
    found = judge(failure_criteria(Failure(peel_stress=7e6)), HISTORY)
    assert {joint: verdict["value"] for joint, verdict in found["peel_stress"].items()} == {"A1": 6e6, "A2": 8e6}
    assert failed_joints(found) == ["A2"]
    assert worst(found) == {"peel_stress": {"value": 8e6, "limit": 7e6, "ok": False}}


def test_each_criterion_has_its_own_verdict():
    found = judge(failure_criteria(Failure(peel_stress=7e6, plastic_work_density=2.5e3)), HISTORY)
    assert failed_joints(found) == ["A2", "A1"]
    assert found["plastic_work_density"]["A1"] == {"value": 3e3, "limit": 2.5e3, "ok": False}


def test_a_limit_that_is_just_met_holds():
    assert failed_joints(judge(failure_criteria(Failure(peel_stress=8e6)), HISTORY)) == []


def test_a_model_without_joints_has_no_verdicts():
    assert judge(failure_criteria(Failure(peel_stress=1.0)), {"joints": np.array([], dtype=str)}) == {}


def test_effects_name_the_materials_that_call_for_them():
    off = decided(MATERIAL_EFFECTS, SimpleNamespace(materials=Materials().by_role))
    assert not any(effect["on"] for effect in off.values())
    hot = SNPB.model_copy(update={"temperature": 398.15})
    on = decided(MATERIAL_EFFECTS, SimpleNamespace(materials={"solder": hot, "bump": SAC305, "die": SILICON}))
    assert all(effect["on"] for effect in on.values())
    assert on["plasticity"]["why"].startswith("solder yields from 18 MPa on, hardening 55 MPa p^0.55; bump yields")
    assert on["thermal_softening"]["why"] == f"solder: yield stress times {1 - (100 / 158) ** 1.4:.3g}"
    assert pytest.approx(1 - (100 / 158) ** 1.4) == SNPB.plasticity.softening(398.15)
