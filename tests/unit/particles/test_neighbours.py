"""Neighbour lists against all pairs in NumPy, and when they are rebuilt."""

import numpy as np
import pytest

from reflowshock.particles.core import neighbours
from reflowshock.particles.core.neighbours import NeighbourList, find_near, find_neighbours, have_moved, tabulate_near


def all_pairs(points, radius):
    """Return the set of neighbours of each point by comparing all pairs."""
    distance = np.linalg.norm(points[:, None] - points[None, :], axis=2)
    return [set(np.flatnonzero((row < radius) & (np.arange(len(points)) != i))) for i, row in enumerate(distance)]


@pytest.mark.parametrize("shape", [(1.0, 1.0, 1.0), (3.0, 0.5, 0.0)])
def test_rows_equal_all_pairs(shape):
    points = np.random.default_rng(1).uniform(size=(300, 3)) * shape
    offsets, indices = find_neighbours(points, 0.2)
    rows = [set(indices[offsets[i] : offsets[i + 1]]) for i in range(len(points))]
    assert rows == all_pairs(points, 0.2)


def test_rows_found_in_blocks_are_the_same(monkeypatch):
    points = np.random.default_rng(2).uniform(size=(300, 3))
    whole = [find_neighbours(points, 0.2), find_near(points[:90], points, 0.2, movers=50)]
    monkeypatch.setattr(neighbours, "ROWS_PER_BLOCK", 40)
    blocks = [find_neighbours(points, 0.2), find_near(points[:90], points, 0.2, movers=50)]
    for expected, rows in zip(whole, blocks, strict=True):
        assert all(np.array_equal(*pair) for pair in zip(expected, rows, strict=True))
    assert find_near(points[:0], points, 0.2)[0].tolist() == [0]


def test_points_near_centres_equal_all_pairs_and_pairs_of_fixed_ones_are_left_out():
    random = np.random.default_rng(4)
    centres, points = random.uniform(-0.5, 1.5, (80, 3)), random.uniform(size=(200, 3))  # some far outside
    distance = np.linalg.norm(centres[:, None] - points[None], axis=2)
    offsets, indices = find_near(centres, points, 0.3)
    for i in range(80):
        assert sorted(indices[offsets[i] : offsets[i + 1]]) == np.flatnonzero(distance[i] < 0.3).tolist()
    offsets, indices = find_near(points, points, 0.3, movers=60)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    for i in range(200):
        near = np.flatnonzero(distance[i] < 0.3)
        assert sorted(indices[offsets[i] : offsets[i + 1]]) == [j for j in near if i < 60 or j < 60]


def test_a_table_has_the_same_neighbours_as_compressed_rows():
    points = np.random.default_rng(8).uniform(size=(300, 3))
    offsets, indices = find_near(points, points, 0.3, movers=200)
    table, counts = tabulate_near(points, points, 0.3, 200, np.empty((0, 0), np.int32))
    assert np.array_equal(counts, np.diff(offsets))
    for i in range(300):
        assert sorted(table[i, : counts[i]]) == sorted(indices[offsets[i] : offsets[i + 1]])
    assert tabulate_near(points, points, 0.25, 200, table)[0] is table


def test_a_translation_of_all_points_is_no_motion():
    points = np.random.default_rng(6).uniform(size=(50, 3))
    moved = points + [5.0, -1.0, 2.0]
    assert not have_moved(moved.T, points.T, 0.1)
    moved[3, 0] += 0.099
    assert not have_moved(moved.T, points.T, 0.1)
    moved[3, 0] += 0.003
    assert have_moved(moved.T, points.T, 0.1)
    moved[3, 0] = np.nan
    assert have_moved(moved.T, points.T, 0.1)


def test_list_is_rebuilt_only_past_half_the_skin():
    points = np.random.default_rng(2).uniform(size=(50, 3))
    neighbours = NeighbourList(radius=0.3, skin=0.1)
    neighbours.update(points)
    neighbours.update(points + [0.4, 0.0, 0.0])
    assert neighbours.builds == 1
    moved = points.copy()
    moved[7] += [0.06, 0.0, 0.0]
    moved[8] -= [0.06, 0.0, 0.0]
    neighbours.update(moved)
    assert neighbours.builds == 2


def test_list_keeps_all_neighbours_while_points_move_within_the_skin():
    random = np.random.default_rng(3)
    points = random.uniform(size=(200, 3))
    neighbours = NeighbourList(radius=0.2, skin=0.1)
    neighbours.update(points)
    direction = random.normal(size=points.shape)
    moved = points + 0.049 * direction / np.linalg.norm(direction, axis=1)[:, None]
    neighbours.update(moved)
    assert neighbours.builds == 1
    for i, expected in enumerate(all_pairs(moved, 0.2)):
        assert expected <= set(neighbours.indices[neighbours.offsets[i] : neighbours.offsets[i + 1]])


def test_positions_must_be_finite():
    with pytest.raises(FloatingPointError, match="not finite"):
        find_neighbours(np.array([[0.0, 0.0, np.nan]]), 1.0)
