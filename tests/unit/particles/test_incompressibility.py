from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from reflowshock.particles.discretisation.incompressibility import SaddlePoint, SolveFailed, solve_saddle_point


def problem(size=60, rows=20, seed=11):
    """Return a random saddle-point problem."""
    rng = np.random.default_rng(seed)
    root = sparse.random(size, size, 0.1, random_state=seed) + 3.0 * sparse.identity(size)
    constraint = sparse.random(rows, size, 0.2, random_state=seed + 1) + sparse.eye(rows, size)
    return SaddlePoint((root @ root.T).tocsr(), constraint.tocsr(), rng.normal(size=size), rng.normal(size=rows))


def test_solution_equals_the_dense_solution():
    system = problem()
    a, c = system.operator.toarray(), system.constraint.toarray()
    zero = np.zeros((len(c), len(c)))
    expected = np.linalg.solve(np.block([[a, -c.T], [c, zero]]), np.concatenate((system.load, system.rate)))
    solution = solve_saddle_point(system)
    assert np.concatenate((solution.velocity, solution.pressure)) == pytest.approx(expected, abs=1e-7)


def test_stabilised_solution_equals_the_dense_solution():
    system = replace(problem(), stabilisation=0.3 * sparse.identity(20, format="csr"))
    a, c, s = system.operator.toarray(), system.constraint.toarray(), system.stabilisation.toarray()
    expected = np.linalg.solve(np.block([[a, -c.T], [c, s]]), np.concatenate((system.load, system.rate)))
    solution = solve_saddle_point(system)
    assert np.concatenate((solution.velocity, solution.pressure)) == pytest.approx(expected, abs=1e-7)


def test_dependent_constraints_are_an_error():
    system = problem()
    twice = sparse.vstack((system.constraint, system.constraint[:1]), format="csr")
    contradiction = np.append(system.rate, system.rate[0] + 1.0)
    with pytest.raises(SolveFailed, match="residuals"):
        solve_saddle_point(SaddlePoint(system.operator, twice, system.load, contradiction))
