"""Conjugate gradients without a matrix, and preconditioned with the factors of an earlier step's matrix."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import SolveFailed, cholesky
from reflowshock.particles.discretisation.lagged_solver import LaggedSolver

Apply = Callable[[Floats], Floats]
MAX_ITERATIONS = 500
# Of the norm of the right-hand side: more than this is no solution.
RESIDUAL_LIMIT = 1e-4
# Factors cost as much as some fifty iterations.
MANY_ITERATIONS = 25
# Of the mean of the diagonal, added to it in the factors only: pressures from particle to particle hardly show.
SHIFT = 1e-6


@dataclass(frozen=True, slots=True)
class Tolerance:
    """When a solve ends: at this share of the norm of the right-hand side, or at this residual."""

    relative: float
    absolute: float


def conjugate_gradients(
    operator: Apply, right: Floats, start: Floats, precondition: Apply, tolerance: Tolerance
) -> tuple[Floats, int]:
    """Solve A x = b for a symmetric positive definite A.

    Args:
        operator: x -> A x.
        right: b, `(d,)`.
        start: `(d,)`.
        precondition: r -> P^-1 r.
        tolerance: when it ends.

    Returns:
        x `(d,)` and the iterations.

    Raises:
        SolveFailed: the true residual stays above the limit.
    """
    norm = float(np.linalg.norm(right))
    enough = max(tolerance.relative * norm, tolerance.absolute)
    solution = start.copy()
    residual = right - operator(solution)
    direction, product, iterations = np.zeros_like(right), 1.0, 0
    while np.linalg.norm(residual) > enough and iterations < MAX_ITERATIONS:
        scaled = precondition(residual)
        before, product = product, float(residual @ scaled)
        direction = scaled + (product / before if iterations else 0.0) * direction
        image = operator(direction)
        length = product / float(direction @ image)
        solution += length * direction
        residual -= length * image
        iterations += 1
    left = float(np.linalg.norm(right - operator(solution))) if iterations else 0.0
    if not left <= max(RESIDUAL_LIMIT * norm, 2.0 * enough):
        raise SolveFailed(f"conjugate gradients: relative residual {left / norm:.2e} after {iterations} iterations")
    return solution, iterations


@dataclass(slots=True)
class LaggedCholesky(LaggedSolver):
    """Factors that are made anew when their last use took many iterations."""

    def solve(
        self, operator: Apply, matrix: Callable[[], sparse.csr_matrix], right: Floats, tolerance: Tolerance
    ) -> Floats:
        """Solve A x = b from zero; `matrix` assembles A where new factors are needed.

        Raises:
            SolveFailed: the true residual stays above the limit.
        """
        if self.origin is None or self.iterations > MANY_ITERATIONS or self.origin.shape[0] != len(right):
            self.origin, self._solver = matrix(), None
        if self._solver is None:
            shift = SHIFT * self.origin.diagonal().mean()
            self._solver = cholesky((self.origin + shift * sparse.identity(len(right))).tocsr())
        solver = self._solver
        found, known = solver.getOperators()[0].createVecs()

        def precondition(residual: Floats) -> Floats:
            known.setArray(residual)
            solver.solve(known, found)
            return found.getArray().copy()

        solution, self.iterations = conjugate_gradients(operator, right, np.zeros_like(right), precondition, tolerance)
        return solution
