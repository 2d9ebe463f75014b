"""Partition of cells among ranks: work proportional to speed at each step level, with few cut nodes."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.grids import grid, mesh_of
from reflowshock.fem.parallel.partition import partition


def plate(count: int = 24):
    """Return the mesh of a plate, from elements along its shorter side."""
    return mesh_of(
        *grid(np.linspace(0, 3, 3 * count // 2 + 1), np.linspace(0, 2, count + 1), [0, 0.05, 0.1]), "board", {}
    )


def shares(rank: np.ndarray, work: np.ndarray, ranks: int) -> np.ndarray:
    """Return the share of the work of each rank, shape (ranks, ...)."""
    return np.array([work[rank == k].sum(axis=0) for k in range(ranks)]) / work.sum(axis=0)


@pytest.mark.parametrize("speeds", [(1.0, 1.0), (1.0, 3.0), (1.0, 1.0, 1.0), (2.0, 1.0, 1.0, 0.5)])
def test_work_is_shared_as_the_speeds(speeds):
    mesh, speeds = plate(), np.array(speeds)
    work = np.random.default_rng(1).uniform(1.0, 4.0, (len(mesh.cells), 1))
    fractions = shares(partition(mesh, work, speeds), work, len(speeds))[:, 0]
    assert fractions == pytest.approx(speeds / speeds.sum(), abs=5e-3)


def test_every_level_is_shared_by_one_cut():
    """All fine cells are in a corner: a plain bisection would put them on one rank."""
    mesh = plate()
    centre = mesh.points[mesh.cells].mean(axis=1)
    fine = (centre[:, 0] < 0.75) & (centre[:, 1] < 0.75)
    work = np.column_stack([~fine * 1.0, fine * 8.0])
    fractions = shares(partition(mesh, work, np.ones(2)), work, 2)
    assert np.abs(fractions - 0.5).max() < 0.1


def test_equal_cells_are_cut_along_a_short_line():
    mesh = plate()
    rank = partition(mesh, np.ones((len(mesh.cells), 1)), np.ones(2))
    shared = np.intersect1d(mesh.cells[rank == 0], mesh.cells[rank == 1])
    assert len(shared) == 25 * 3


def test_more_ranks_than_cells_leave_some_without():
    mesh = mesh_of(*grid([0, 1, 2], [0, 1], [0, 1]), "board", {})
    assert sorted(partition(mesh, np.ones((2, 1)), np.ones(4))) == [0, 1]
