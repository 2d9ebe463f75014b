import numpy as np
import pytest

from reflowshock.particles.core.neighbours import NeighbourList, find_neighbours


def brute_force(points, radius):
    """NumPy twin: all pairs."""
    distance = np.linalg.norm(points[:, None] - points[None, :], axis=2)
    return [set(np.flatnonzero((row < radius) & (np.arange(len(points)) != i))) for i, row in enumerate(distance)]


@pytest.mark.parametrize("shape", [(1.0, 1.0, 1.0), (3.0, 0.5, 0.0)])
def test_rows_equal_all_pairs(shape):
    points = np.random.default_rng(1).uniform(size=(300, 3)) * shape
    offsets, indices = find_neighbours(points, 0.2)
    found = [set(indices[offsets[i] : offsets[i + 1]]) for i in range(len(points))]
    assert found == brute_force(points, 0.2)


def test_list_is_rebuilt_only_past_half_the_skin():
    points = np.random.default_rng(2).uniform(size=(50, 3))
    neighbours = NeighbourList(radius=0.3, skin=0.1)
    neighbours.update(points)
    neighbours.update(points + [0.04, 0.0, 0.0])
    assert neighbours.builds == 1
    moved = points.copy()
    moved[7] += [0.06, 0.0, 0.0]
    neighbours.update(moved)
    assert neighbours.builds == 2


def test_list_keeps_all_neighbours_while_points_move_within_the_skin():
    rng = np.random.default_rng(3)
    points = rng.uniform(size=(200, 3))
    neighbours = NeighbourList(radius=0.2, skin=0.1)
    neighbours.update(points)
    direction = rng.normal(size=points.shape)
    moved = points + 0.049 * direction / np.linalg.norm(direction, axis=1)[:, None]
    neighbours.update(moved)
    assert neighbours.builds == 1
    for i, row in enumerate(brute_force(moved, 0.2)):
        assert row <= set(neighbours.indices[neighbours.offsets[i] : neighbours.offsets[i + 1]])


def test_positions_must_be_finite():
    with pytest.raises(FloatingPointError, match="not finite"):
        find_neighbours(np.array([[0.0, 0.0, np.nan]]), 1.0)
