"""One-leg method on an oscillator: order, damping, stiff modes, variable steps."""

from itertools import cycle, islice

import numpy as np
import pytest

from reflowshock.particles.steps.one_leg import RADIUS, OneLeg


def oscillate(sizes, omega=1.0):
    """Return positions and velocities of an oscillator that starts at 1."""
    x, v, history = np.array([[1.0, 0.0, 0.0]]), np.zeros((1, 3)), OneLeg.start(1)
    states = [(1.0, 0.0)]
    for size in sizes:
        base = history.base(x, v, size)
        stiff = base.time_step * omega**2
        mean = (base.velocity - stiff * base.points) / (1.0 + stiff * base.time_step)
        history = history.followed_by(v, mean, size)
        x, v = x + history.displacement, v + history.velocity_change
        states.append((x[0, 0], v[0, 0]))
    return np.array(states)


@pytest.mark.parametrize("shares", [(1.0,), (0.6, 1.4), (1.6, 0.4, 1.0)])
def test_the_order_is_two_whatever_the_steps(shares):
    errors = []
    for count in (60, 120, 240):
        sizes = list(islice(cycle(shares), count))
        x, v = oscillate(6.0 / sum(sizes) * np.array(sizes))[-1]
        errors.append(np.hypot(x - np.cos(6.0), v + np.sin(6.0)))
    assert np.log2(errors[0] / errors[1]) > 1.8
    assert np.log2(errors[1] / errors[2]) > 1.9


def test_a_swing_hardly_loses_energy():
    """At 30 steps per period the damping rate is 0.00008 of the frequency, compared with 0.002 for BDF2."""
    states = oscillate(np.full(300, 2.0 * np.pi / 30.0))
    size = np.hypot(*states.T)
    assert -np.log(size[-1] / size[30]) / (18.0 * np.pi) == pytest.approx(8e-5, rel=0.1)


def test_stiff_modes_die_away():
    """The double root damps them at any constant or variable step."""
    size = np.hypot(*oscillate(np.ones(60), 1e6).T)
    assert size[-1] < 1e-6 * size.max()
    assert size[-1] / size[-2] == pytest.approx(RADIUS, rel=0.1)
    assert np.hypot(*oscillate(1.15 ** np.arange(40.0), 1e6).T)[-1] < 1e-6


def test_a_particle_that_is_caught_stands_still():
    history = OneLeg(np.ones((2, 3)), np.ones((2, 3)), 1.0).stopped(np.array([True, False]), np.zeros((2, 3)))
    assert (history.displacement[0] == 0.0).all()
    assert (history.velocity_change[0] == 0.0).all()
    assert (history.displacement[1] == 1.0).all()
