from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from reflowshock.particles.discretisation.incompressibility import SaddlePoint, SolveFailed, solve


def problem(size=60, rows=20, seed=11):
    rng = np.random.default_rng(seed)
    root = sparse.random(size, size, 0.1, random_state=seed) + 3.0 * sparse.identity(size)
    constraint = sparse.random(rows, size, 0.2, random_state=seed + 1) + sparse.eye(rows, size)
    return SaddlePoint((root @ root.T).tocsr(), constraint.tocsr(), rng.normal(size=size), rng.normal(size=rows))


def test_solution_equals_the_dense_solution():
    given = problem()
    a, c = given.operator.toarray(), given.constraint.toarray()
    zero = np.zeros((len(c), len(c)))
    expected = np.linalg.solve(np.block([[a, -c.T], [c, zero]]), np.concatenate((given.load, given.rate)))
    found = solve(given)
    assert np.concatenate((found.velocity, found.pressure)) == pytest.approx(expected, abs=1e-7)


def test_stabilised_solution_equals_the_dense_solution():
    given = replace(problem(), stabilisation=0.3 * sparse.identity(20, format="csr"))
    a, c, s = given.operator.toarray(), given.constraint.toarray(), given.stabilisation.toarray()
    expected = np.linalg.solve(np.block([[a, -c.T], [c, s]]), np.concatenate((given.load, given.rate)))
    found = solve(given)
    assert np.concatenate((found.velocity, found.pressure)) == pytest.approx(expected, abs=1e-7)


def test_dependent_constraints_are_an_error():
    given = problem()
    twice = sparse.vstack((given.constraint, given.constraint[:1]), format="csr")
    contradiction = np.append(given.rate, given.rate[0] + 1.0)
    with pytest.raises(SolveFailed, match="residuals"):
        solve(SaddlePoint(given.operator, twice, given.load, contradiction))
