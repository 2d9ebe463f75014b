"""Rows of boxes: vectorised force against the sum over elements, on meshes with interrupted rows."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.grids import grid
from reflowshock.fem.elements.element import Elements, element_kind, element_stiffness
from reflowshock.fem.forces.box_rows import BoxRows
from reflowshock.fem.forces.force_congruent import CongruentElements
from reflowshock.fem.kernels.box_rows import LONGEST
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4, SAC405

MATERIALS = np.array([elasticity_matrix(FR4), elasticity_matrix(SAC405)])


def elements_of(points: np.ndarray, cells: np.ndarray, formulation: str = "incompatible_modes") -> Elements:
    """Return elements of two materials, assigned at random."""
    random = np.random.default_rng(len(cells))
    material = random.integers(0, 2, len(cells)).astype(np.int32)
    return Elements(points, cells, material, MATERIALS, np.ones(len(cells)), element_kind(8, formulation))


def force_twin(elements: Elements, displacement: np.ndarray) -> np.ndarray:
    """Return -K u element by element."""
    force = np.zeros_like(displacement)
    for nodes, stiffness in zip(elements.cells, element_stiffness(elements), strict=True):
        force[nodes] -= (stiffness @ displacement[nodes].ravel()).reshape(8, 3)
    return force


def assert_same_force(elements: Elements) -> CongruentElements:
    """Check the force of elements in rows against the sum over elements; return the term."""
    displacement = np.random.default_rng(1).uniform(-1, 1, elements.points.shape)
    term = CongruentElements.build(elements)
    exact = force_twin(elements, displacement)
    for _ in range(2):  # no state remains from a call
        force = np.zeros_like(displacement)
        term.add(displacement, force)
        assert np.abs(force - exact).max() < 1e-13 * np.abs(exact).max()
    return term


@pytest.mark.parametrize("counts", [(1, 1, 1), (2, 1, 1), (9, 2, 3), (2, 17, 3), (3, 2, 10)])
@pytest.mark.parametrize("formulation", ["incompatible_modes", "one_point"])
def test_grids_with_two_materials_and_holes(counts, formulation):
    points, cells = grid(*(np.cumsum([0.0, *np.linspace(1, 3, count)]) * 1e-3 for count in counts))
    is_solid = np.random.default_rng(0).uniform(size=len(cells)) < 0.8
    is_solid[0] = True
    assert_same_force(elements_of(points, cells[is_solid], formulation))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_rows_run_along_the_axis_of_the_longest_and_are_cut_at_the_limit(axis):
    counts = [2, 2, 2]
    counts[axis] = LONGEST + 20
    points, cells = grid(*(np.arange(count + 1) * 1e-3 for count in counts))
    elements = Elements(points, cells, np.zeros(len(cells), np.int32), MATERIALS[:1], np.ones(len(cells)))
    term = assert_same_force(elements)
    assert term.axes[0] == axis
    assert sorted(set(term.rows[:, 4])) == [20, LONGEST]


def test_numbering_does_not_matter():
    points, cells = grid(np.arange(12.0), np.arange(4.0), np.arange(4.0))
    random = np.random.default_rng(3)
    order = random.permutation(len(points))
    shuffled = np.empty_like(points)
    shuffled[order] = points
    assert_same_force(elements_of(shuffled, order[random.permutation(cells)].astype(np.int32)))


def test_boxes_whose_edges_do_not_match_have_lines_of_their_own():
    """A box of length 1 lies above a box of length 2, so one node has two successors."""
    points, cells = grid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0])
    below = [[0.0, -1, 0], [2, -1, 0], [2, 0, 0], [0, -1, 1], [2, -1, 1], [2, 0, 1]]
    both = np.vstack([cells, [8, 9, 0, 10, 11, 12, 4, 13]]).astype(np.int32)
    term = assert_same_force(elements_of(np.vstack([points, below]), both))
    assert term.rows[:, 4].tolist() == [1, 1]
    assert len(term.nodes) > len(points) + len(below)


def test_what_is_past_the_end_of_a_line_does_not_matter():
    points, cells = grid(np.arange(6.0), np.arange(3.0), np.arange(3.0))
    elements = elements_of(points, cells)
    displacement, force = np.zeros_like(points), np.zeros_like(points)
    displacement[0] = np.nan
    CongruentElements.build(elements).add(displacement, force)
    touched = np.unique(cells[(cells == 0).any(axis=1)])
    assert np.isnan(force[touched]).all()
    assert not np.isnan(np.delete(force, touched, axis=0)).any()


def test_positions_of_a_line_follow_each_other():
    points, cells = grid(np.arange(5.0), np.arange(3.0), np.arange(2.0))
    rows = BoxRows.find(points, cells, np.zeros(len(cells), np.int32))
    assert len(rows.nodes) == len(points)
    assert rows.rows.tolist() == [[0, 5, 15, 20, 4, 0], [5, 10, 20, 25, 4, 0]]
