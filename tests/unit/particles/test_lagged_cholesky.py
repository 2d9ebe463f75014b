"""Conjugate gradients with Cholesky factors of an earlier matrix."""

import numpy as np
import pytest

from reflowshock.particles.discretisation.incompressibility import SolveFailed
from reflowshock.particles.discretisation.lagged_cholesky import Band, LaggedCholesky, Tolerance


def test_factors_of_an_earlier_matrix_solve_and_are_restored():
    """A changed matrix takes more iterations; the solution does not depend on the factors."""
    random = np.random.default_rng(8)
    half, right = random.normal(size=(30, 60)), random.normal(size=30)
    first, now = half @ half.T, (half + 0.02 * random.normal(size=half.shape)) @ (half.T)
    now = 0.5 * (now + now.T)

    tolerance, factors, again = Tolerance(1e-12, 0.0), LaggedCholesky(), LaggedCholesky()
    exact = factors.solve(first.__matmul__, lambda: Band.of(first), right, tolerance)
    assert exact == pytest.approx(np.linalg.solve(first, right))
    few = factors.iterations
    again.restore(factors.saved())
    solution = factors.solve(now.__matmul__, lambda: pytest.fail("the factors are there"), right, tolerance)
    assert solution == pytest.approx(np.linalg.solve(now, right))
    assert factors.iterations > few
    same = again.solve(now.__matmul__, lambda: pytest.fail("the factors are there"), right, tolerance)
    assert np.array_equal(solution, same)


def test_a_matrix_without_factors_is_an_error():
    with pytest.raises(SolveFailed, match="pivot 2 is not positive"):
        LaggedCholesky().solve(
            lambda x: x, lambda: Band.of(np.array([[1.0, 2.0], [2.0, 1.0]])), np.ones(2), Tolerance(1e-9, 0.0)
        )
