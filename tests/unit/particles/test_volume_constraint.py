"""Surface-only solution at constant volume."""

import numpy as np
import pytest
from scipy import sparse

from reflowshock.particles.discretisation.incompressibility import SaddlePoint
from reflowshock.particles.discretisation.volume_constraint import solve_volume


def test_what_nothing_moves_stays_where_it_is():
    """The last unknown has no stiffness and load, like the shift of a plate without pinned particles."""
    operator = sparse.csr_matrix(np.array([[2.0, 1.0, 0.0], [1.0, 3.0, 0.0], [0.0, 0.0, 0.0]]))
    operator.eliminate_zeros()
    constraint = sparse.csr_matrix([[1.0, 1.0, 0.0]])
    solution = solve_volume(SaddlePoint(operator, constraint, np.array([1.0, 2.0, 0.0]), np.array([0.5])))
    assert solution.velocity[2] == 0.0
    assert solution.velocity[:2].sum() == pytest.approx(0.5)
