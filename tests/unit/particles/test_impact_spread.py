"""Correlations of the maximum spread of impacting drops."""

import numpy as np
import pytest

from reflowshock.particles.reference.impact_spread import laan, of_measured, pasandideh_fard, roisman, wildeman


def test_correlations_have_the_values_of_their_formulas():
    assert pasandideh_fard(100.0, 1000.0, 0.5 * np.pi) ** 2 == pytest.approx(112.0 / (3.0 + 400.0 / np.sqrt(1000.0)))
    assert roisman(100.0, 1000.0) == pytest.approx(2.83, abs=0.005)
    assert laan(100.0, 1000.0) == pytest.approx(2.67, abs=0.005)
    width, angle = wildeman(100.0, 1000.0, 2.0), 2.0
    loss = 0.5 + 0.7 / np.sqrt(1000.0) * width**2 * np.sqrt(width - 1.0)
    assert 0.03 * (1.0 - np.cos(angle)) * width**2 + loss == pytest.approx(1.0 + 0.12)


def test_a_larger_angle_makes_drops_narrower_and_slow_ones_have_no_correlation():
    for width in (pasandideh_fard, wildeman):
        assert width(30.0, 500.0, np.radians(120.0)) < 0.95 * width(30.0, 500.0, np.radians(90.0))
    low, high = of_measured(30.0, 500.0, 0.5 * np.pi)
    assert (round(low, 2), round(high, 2)) == (1.94, 2.24)
    assert of_measured(8.0, 500.0, 1.0) is None and of_measured(30.0, 7.7, 1.0) is None


def test_widths_are_some_for_whatever_drop_or_not_told():
    assert of_measured(25.0, 1e6, np.radians(20.0)) is None
    for weber in (25.0, 30.0, 1e3, 1e6):
        for reynolds in (100.0, 2000.0, 1e6, 1e12):
            for degrees in (1.0, 20.0, 90.0, 180.0):
                assert wildeman(weber, reynolds, np.radians(degrees)) > 1.0
                low, high = of_measured(weber, reynolds, np.radians(degrees)) or (1.2, 1.2)
                assert 1.2 <= low <= high
