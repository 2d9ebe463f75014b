"""Decisions on effects name the responsible materials or limits; fatigue laws have scatter."""

from types import SimpleNamespace

import pytest

from reflowshock.effect import decide_all
from reflowshock.fem.estimates.drop_effects import Failing
from reflowshock.fem.estimates.material_effects import MATERIAL_EFFECTS
from reflowshock.fem.problem.failure import Failure, Life
from reflowshock.materials.library import SAC305, SILICON, SNPB
from reflowshock.materials.roles import ELASTIC


def test_joints_are_judged_where_there_is_a_limit():
    off = Failing.by_limits(Failure.model_validate({"board_deflection": {"apply": "off"}}))
    assert not off["on"] and off["why"].startswith("shock.failure gives no limit")
    limits = {name: {"limit": 1e7, "source": "a test"} for name in ("peel_stress", "layer_von_mises")}
    on = Failing.by_limits(Failure.model_validate(limits))
    assert (on["on"], on["why"]) == (True, "judges peel stress, layer von mises, board deflection")


def test_life_follows_the_law_within_its_scatter():
    law = Life(measure="peel_stress", constant=4.8e6, exponent=3.0, scatter=2.0, source="ten boards")
    assert law.drops(60.0) == pytest.approx((4.8e6 / 60.0**3, 4.8e6 / 60.0**3 / 2.0, 2.0 * 4.8e6 / 60.0**3))
    assert law.drops(120.0)[0] == pytest.approx(law.drops(60.0)[0] / 8.0)


def test_effects_name_the_materials_that_call_for_them():
    off = decide_all(MATERIAL_EFFECTS, SimpleNamespace(materials=ELASTIC.by_role))
    assert not any(effect["on"] for effect in off.values())
    hot = SNPB.model_copy(update={"temperature": 398.15})
    on = decide_all(MATERIAL_EFFECTS, SimpleNamespace(materials={"solder": hot, "bump": SAC305, "die": SILICON}))
    assert all(effect["on"] for effect in on.values())
    assert on["plasticity"]["why"].startswith("solder yields from 18 MPa on, hardening 55 MPa p^0.55; bump yields")
    assert on["thermal_softening"]["why"] == f"solder: yield stress times {1 - (100 / 158) ** 1.4:.3g}"
    assert pytest.approx(1 - (100 / 158) ** 1.4) == SNPB.plasticity.softening(398.15)
