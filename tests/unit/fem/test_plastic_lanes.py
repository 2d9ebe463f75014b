"""Radial return in sixteen lanes against a single point, and its logarithm and exponential against libm."""

import numpy as np
import pytest
from numba import njit

from reflowshock.fem.elements.stress import von_mises
from reflowshock.fem.kernels.lanes import LANES
from reflowshock.fem.kernels.nonlinear import INCREMENT, MISES, PLASTIC, STATE_SLOTS, WORK_SLOTS
from reflowshock.fem.kernels.plastic_lanes import add_work, law_of, plastic_flow
from reflowshock.fem.kernels.plasticity import plastic_increment
from reflowshock.fem.kernels.vectors.functions import exp, log
from reflowshock.fem.kernels.vectors.memory import broadcast, place, store
from reflowshock.fem.kernels.vectors.vector import WIDTH

STIFFNESS, YIELD = 55e9, 40e6  # 3 G, A [Pa]


@njit
def write_functions(x, logarithm, exponential):
    store(place(logarithm), 0, log(broadcast(abs(x))))
    store(place(exponential), 0, exp(broadcast(x)))


def functions_of(x: float) -> tuple[float, float]:
    """Return ln |x| and e^x of vectors, the same in all lanes."""
    results = np.empty((2, WIDTH))
    write_functions(x, *results)
    assert (results == results[:, :1]).all()
    return tuple(results[:, 0])


def test_logarithm_and_exponential():
    for x in (1e-300, 1e-9, 0.5, np.sqrt(0.5), 1.0, np.sqrt(2.0), 3.0, 1e300):
        assert functions_of(x)[0] == pytest.approx(np.log(x), rel=1e-15, abs=1e-16)
    for x in (-500.0, -1.0, -1e-9, 0.0, 0.3, 1.0, 30.0, 500.0):
        assert functions_of(x)[1] == pytest.approx(np.exp(x), rel=1e-15 * max(1.0, abs(x)))


@pytest.mark.parametrize("sensitivity", [0.0, 0.01, 0.3])
@pytest.mark.parametrize("exponent", [0.1, 0.7, 1.0])
@pytest.mark.parametrize("step", [1e-10, 1e-6, np.inf])
def test_lanes_return_as_one_point_does(sensitivity, exponent, step):
    """Lanes mix elastic states with trials near and far outside the yield surface, with and without plastic strain."""
    constants = np.array([STIFFNESS, YIELD, 300e6, exponent, sensitivity, 1e-3])
    law = law_of(constants[None], 0, step)
    random = np.random.default_rng(7)
    for excess in (1e-9, 1e-3, 1.0, 100.0):
        w, state = np.zeros(WORK_SLOTS), random.normal(size=(2, STATE_SLOTS))
        strain = random.choice([0.0, 1e-12, 1e-5, 1e-2, 1.0], LANES)
        outside = excess * random.uniform(0.1, 1.0, LANES)
        outside[::5] = -0.3
        trial = (YIELD + 300e6 * strain**exponent) * (1.0 + outside)
        stress = state[1, : 6 * LANES].reshape(6, LANES)
        stress *= trial / von_mises(stress.T)
        w[MISES : MISES + LANES], state[1, PLASTIC : PLASTIC + LANES] = von_mises(stress.T), strain
        w[INCREMENT : INCREMENT + 6 * LANES] = 1e-6 * random.normal(size=6 * LANES)
        before = stress.copy()
        grown = np.array([plastic_increment(*of, constants, step) for of in zip(trial, strain, strict=True)])
        assert plastic_flow(w, state, 1, law) == (grown.max() > 0.0)
        increments = state[1, PLASTIC : PLASTIC + LANES] - strain
        assert np.abs(increments - grown).max() <= 1e-9 * grown.max() + 1e-15 * strain.max()
        assert np.allclose(von_mises(stress.T), trial - STIFFNESS * grown, rtol=1e-9, atol=1e-9 * trial.max())
        assert np.allclose(stress[:3].sum(axis=0), before[:3].sum(axis=0), rtol=1e-9, atol=1e-9 * trial.max())
        assert np.array_equal(stress[:, grown == 0.0], before[:, grown == 0.0])
        work = np.zeros(LANES)
        add_work(w, np.ones((2, LANES)), 1, work)
        assert not work[grown == 0.0].any()
