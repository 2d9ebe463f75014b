"""The update of a step against plain NumPy."""

import numpy as np
import pytest

from fem.kernels_motion import STRIP, advance


@pytest.mark.parametrize("count", [1, 2, STRIP // 3, STRIP // 3 + 1, STRIP + 5])
def test_step_of_central_differences(count):
    random = np.random.default_rng(count)
    state = random.uniform(-1, 1, (3, count, 3))
    mobility = random.uniform(1, 2, (count, 3)) * (random.uniform(size=(count, 3)) < 0.7)
    gravity, step = np.array([0.3, -2.0, 9.81]), 0.1
    displacement, velocity, force = state.copy()
    velocity += step * (force * mobility + np.where(mobility > 0, gravity, 0.0))
    displacement += step * velocity
    advance(state, mobility, gravity, step)
    assert np.allclose(state, [displacement, velocity, force], rtol=1e-14, atol=1e-15)
    assert np.array_equal(state[2], force)
