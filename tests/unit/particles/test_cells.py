"""Counting sort into cells against a NumPy twin, for any number of threads."""

import numba
import numpy as np

from reflowshock.particles.core.cells import extent, sort_into_cells


def test_points_are_sorted_by_cell_and_keep_their_order_within_a_cell(every_thread):
    points = np.random.default_rng(5).uniform(-0.2, 1.2, (500, 3))  # some are outside the grid
    origin, size, shape = np.zeros(3), 0.25, np.array([4, 3, 4])
    inside = np.clip((points / size).astype(int), 0, shape - 1)
    numbers = np.ravel_multi_index(tuple(inside.T), tuple(shape))
    for threads in (1, every_thread):
        numba.set_num_threads(threads)
        cells = sort_into_cells(points, origin, size, shape)
        assert np.array_equal(cells.permutation, np.argsort(numbers, kind="stable"))
        assert np.array_equal(cells.coordinates, points[cells.permutation].T)
        assert np.array_equal(np.diff(cells.starts), np.bincount(numbers, minlength=shape.prod()))


def test_extent_counts_points_that_are_not_finite():
    points = np.array([[0.0, 1.0, 2.0], [3.0, -1.0, np.inf], [np.nan, 0.0, 0.0]])
    low, high, not_finite = extent(points[:1])
    assert low == high == (0.0, 1.0, 2.0) and not_finite == 0
    assert extent(points)[2] == 2
