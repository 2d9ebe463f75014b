"""Boxes have a separate force term where it is faster, with equal forces."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.boxes import KINDS, elements_of
from reflowshock.cases.hard.trials.grids import grid
from reflowshock.fem.elements.kind import ElementKind
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.forces.force_congruent import FEW
from tests.support.fem_bodies import STEEL

KIND: ElementKind = KINDS["incompatible_modes"]


@pytest.mark.parametrize(("boxes", "terms"), [(FEW - 1, 1), (FEW, 2)])
def test_few_boxes_among_others_are_assembled(boxes, terms):
    points, cells = grid(np.arange(boxes + 2.0), [0.0, 1.0], [0.0, 1.0])
    points[points[:, 0] > boxes + 0.5, 1] *= 1.1  # the last one is distorted
    elements = elements_of(KIND, points, cells, [STEEL])
    assembled = linear_terms(elements)
    assert len(assembled) == terms
    displacement = np.random.default_rng(3).uniform(-1, 1, points.shape)
    force, exact = np.zeros_like(points), np.zeros_like(points)
    for term in assembled:
        term.add(displacement, force)
    AssembledElements.build(elements).add(displacement, exact)
    assert np.abs(force - exact).max() < 1e-12 * np.abs(exact).max()


def test_boxes_alone_share_their_matrix_however_few():
    points, cells = grid(np.arange(3.0), [0.0, 1.0], [0.0, 1.0])
    (term,) = linear_terms(elements_of(KIND, points, cells, [STEEL]))
    assert not isinstance(term, AssembledElements)
