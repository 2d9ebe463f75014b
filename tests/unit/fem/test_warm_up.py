"""A force evaluation at rest does not change path-dependent elements."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.grids import grid
from reflowshock.fem.elements.element import Elements
from reflowshock.fem.forces.force import force_terms
from reflowshock.fem.model.assembly import warm_up
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import SAC305


@pytest.mark.parametrize(("kinematics", "rounding"), [("small", 0.0), ("finite", 1e-4)])
def test_rest_leaves_no_path(kinematics, rounding):
    """The tolerance is round-off: 1e-4 Pa is 2e-15 of Young's modulus."""
    points, cells = grid(*[np.linspace(0.0, 1.0, 3)] * 3)
    elements = Elements(
        points, cells, np.zeros(len(cells), np.int32), elasticity_matrix(SAC305)[None], np.full(len(cells), 7380.0)
    )
    terms = force_terms(elements, [SAC305], kinematics, 1e-8)
    before = [{name: array.copy() for name, array in term.history.items()} for term in terms]
    assert any(before)
    warm_up(terms, len(points))
    for term, history in zip(terms, before, strict=True):
        for name, array in term.history.items():
            assert array == pytest.approx(history[name], abs=rounding), name
