"""Estimated damping of a dropped board: Steinberg's transmissibility, precedence of given damping, contradictions."""

import math
from types import SimpleNamespace

import pytest

from reflowshock.fem.estimates.board_damping import BoardDampingEffect, estimated_ratio, with_estimate
from reflowshock.fem.problem.shock import BoardDamping


def test_a_board_of_271_hz_has_three_per_cent_by_mass_alone():
    damping = with_estimate(BoardDamping(), 271.0)
    assert damping.mass_ratio == estimated_ratio(271.0) == pytest.approx(0.0304, rel=1e-2)
    alpha, beta = damping.coefficients
    assert alpha == pytest.approx(math.tau * math.sqrt(271.0), rel=1e-12) and beta == 0.0


def test_damping_of_the_case_and_off_are_kept():
    given = BoardDamping(mass_ratio=0.01, frequency=300.0)
    assert with_estimate(given, 271.0) is given
    assert not any(with_estimate(BoardDamping(estimate="off"), 271.0).coefficients)


@pytest.mark.parametrize(
    ("setting", "on", "ratio", "words"),
    [
        (BoardDamping(), True, 0.5 / math.sqrt(271.0), "estimate without data, Q = sqrt(f1 / Hz) = 16.5"),
        (BoardDamping(mass_ratio=0.01, frequency=271.0), True, 0.01, "given by shock.damping: 1 % of critical"),
        (BoardDamping(estimate="off"), False, 0.0, "estimate = off"),
    ],
)
def test_decision_has_the_ratio_and_its_source(setting, on, ratio, words):
    drop = SimpleNamespace(shock=SimpleNamespace(damping=setting), frequency=271.0, duration=2e-3)
    decision = BoardDampingEffect().decide(drop)
    assert decision["on"] is on and decision["ratio"] == pytest.approx(ratio) and words in decision["why"]
    run = SimpleNamespace(shock=SimpleNamespace(damping=with_estimate(setting, 271.0)))
    report = BoardDampingEffect().report(run)
    assert report["on"] is on and ("Steinberg" in report["why"]) is (ratio > 0.02)
