"""Stability of the window for each scheme that the program can choose, by amplification matrices.

A sample of the grid of benchmarks/coupling_stability.py: m up to 40, impedances a tenth to ten times the board's, mesh
ratios up to 8, flat, distorted and curved interfaces, at the steps that the program chooses. The published scheme
is measured as well and is unstable.
"""

from itertools import product

import pytest

from reflowshock.cases.hard.trials.pairs import SCHEMES, Pair
from reflowshock.cases.hard.trials.windows import PUSH, momentum_error

GROWTH = 1e-8
SAMPLES = {
    "nearly equal": Pair(2, 1.0, 1),
    "stiff": Pair(3, 10.0, 1.5),
    "soft": Pair(3, 0.1, 8 / 3),
    "distorted": Pair(5, 1.0, 2, "distorted"),
    "curved": Pair(5, 10.0, 2, "curved"),
    "fine": Pair(8, 10.0, 8),
    "fast": Pair(40, 10.0, 1.5),
    "thin": Pair(12, 3.0, 2, height=3, thinnest=0.2),
}
TWO_WAY = ("held_velocity", "impulse", "gravouil_combescure", "local_steps")
HARDEST = {("held_velocity", "fast"), *product(TWO_WAY, ("stiff", "curved", "thin"))}
WINDOWS = [
    pytest.param(scheme, sample, marks=() if (scheme, sample) in HARDEST else pytest.mark.long)
    for scheme in TWO_WAY
    for sample in SAMPLES
]


@pytest.mark.parametrize(("scheme", "sample"), WINDOWS)
def test_window_does_not_grow(scheme, sample):
    coupled = SAMPLES[sample].coupled(SCHEMES[scheme])
    assert coupled.plan.substeps > 1
    assert coupled.spectral_radius() <= 1.0 + GROWTH


def test_window_of_nested_levels_does_not_grow():
    models = SAMPLES["thin"].divided(SCHEMES["local_steps, levels auto"])
    assert len(models.division.ratios) > 1
    assert SAMPLES["thin"].coupled(SCHEMES["local_steps, levels auto"]).spectral_radius() <= 1.0 + GROWTH


@pytest.mark.parametrize("sample", ["stiff", "distorted", "curved", "fast"])
def test_scheme_as_printed_grows(sample):
    assert SAMPLES[sample].printed().spectral_radius() > 1.0 + 1e-3


MANY = [pytest.param(scheme, 10_000, marks=pytest.mark.long) for scheme in ("held_velocity", "impulse", "local_steps")]


@pytest.mark.parametrize(("scheme", "windows"), [("held_velocity", 2000), ("local_steps", 2000), *MANY])
def test_energy_does_not_drift_over_many_windows(scheme, windows):
    """The windows follow the push, without damping; benchmarks/coupling_stability.py runs 1e5."""
    coupled = Pair(3, 3.0, 2, layers=3).coupled(SCHEMES[scheme])
    coupled.swing(PUSH)
    drift, interface = coupled.drift(windows=windows, samples=200)
    assert drift <= 1e-3
    assert interface <= 1e-2  # for three elements across the wave; of second order in the window


@pytest.mark.parametrize("scheme", SCHEMES)
def test_momentum_of_a_free_pair(scheme):
    """Local steps and impulses conserve momentum; the other schemes conserve it to second order."""
    errors = [momentum_error(SCHEMES[scheme], fraction) for fraction in (0.9, 0.45)]
    if scheme.startswith(("local_steps", "impulse")):
        assert max(errors) <= 1e-10
    else:
        assert 1e-10 < errors[0] < 5e-3
        assert errors[1] < 0.5 * errors[0]
