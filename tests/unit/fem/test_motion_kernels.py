"""Step update and sums over shared nodes against NumPy."""

import numpy as np
import pytest

from reflowshock.fem.kernels.motion import (
    STRIP,
    add_rows,
    advance,
    kicks_of,
    move,
    sum_in_rank_order,
    work_of_changes,
)
from reflowshock.fem.parallel.exchange import rank_order


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


def test_steps_without_a_new_force_are_those_one_by_one():
    random = np.random.default_rng(5)
    count, first, end, step = 4, 3, STRIP // 3 + 9, 0.1
    state = random.uniform(-1, 1, (3, STRIP, 3))
    mobility = random.uniform(1, 2, (STRIP, 3)) * (random.uniform(size=(STRIP, 3)) < 0.7)
    state[1][mobility == 0.0] = 0.0
    accelerations, changes = random.uniform(-1, 1, (2, count, 3))
    mass, each, work = random.uniform(1, 2, STRIP), state.copy(), 0.0
    each[2] *= count  # an impulse, in the first step
    for k in range(count):
        advance(each, mobility, accelerations[k], step)
        each[2] = 0.0
        work += step * changes[k] @ (mass[first:end] @ each[1, first:end])
    whole, kicks = state.copy(), np.empty((3, 3))
    whole[2] *= count
    kicks_of(accelerations, step, kicks)
    move(whole, mobility, (first, end), kicks, (step, count))
    assert np.allclose(whole[:2, first:end], each[:2, first:end], rtol=1e-13, atol=1e-14)
    assert np.array_equal(whole[:2, :first], state[:2, :first])
    assert np.array_equal(whole[:2, end:], state[:2, end:])
    nodes = mass[first:end], whole[1, first:end], mobility[first:end]
    assert work_of_changes(nodes, changes, accelerations, step) == pytest.approx(work, rel=1e-12)


def test_sums_over_shared_nodes_are_taken_in_the_order_of_ranks():
    """Rank 1 of three receives nodes 4 and 2 from rank 0, and 2 and 5 from rank 2."""
    random = np.random.default_rng(0)
    rows, ranks = np.array([4, 2, 2, 5], np.int32), np.array([0, 0, 2, 2])
    values, received = random.uniform(-1, 1, (6, 3)), random.uniform(-1, 1, (4, 3))
    exact = values.copy()
    exact[2] = received[1] + values[2] + received[2]
    exact[4] = received[0] + values[4]
    exact[5] = values[5] + received[3]
    sum_in_rank_order(*rank_order(rows, ranks, 1), received, values)
    assert np.array_equal(values, exact)


def test_a_node_moves_alike_wherever_it_stands():
    """Copies of a node have different indices on other ranks: vector loops and their remainders must round equally."""
    random = np.random.default_rng(0)
    state, mobility = random.uniform(-1, 1, (3, 40, 3)), random.uniform(1, 2, (40, 3))
    whole, gravity = state.copy(), np.array([0.3, -2.0, 9.81])
    advance(whole, mobility, gravity, 0.1)
    for first in range(40):
        part = state[:, first:].copy()
        advance(part, mobility[first:].copy(), gravity, 0.1)
        assert np.array_equal(part, whole[:, first:])


def test_some_rows_are_added():
    values, total = np.random.default_rng(7).uniform(-1, 1, (2, 9, 3))
    rows = np.array([7, 0, 4], np.int32)
    expected = total.copy()
    expected[rows] += values[rows]
    add_rows(rows, values, total)
    assert np.array_equal(total, expected)
