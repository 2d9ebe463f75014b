"""Conjugate gradients without a matrix, and preconditioned with the factors of an earlier step's matrix."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, sparse

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import SolveFailed
from reflowshock.particles.discretisation.lagged_solver import LaggedSolver

Apply = Callable[[Floats], Floats]
MAX_ITERATIONS = 500
# Of the norm of the right-hand side: more than this is no solution.
RESIDUAL_LIMIT = 1e-4
# Factors cost as much as some forty iterations.
MANY_ITERATIONS = 16
# With factors of another matrix: where these do not do, new ones cost less than to go on.
TOO_MANY_ITERATIONS = 80
# Of the mean of the diagonal, added to it in the factors only: pressures from particle to particle hardly show.
SHIFT = 1e-6


@dataclass(frozen=True, slots=True)
class Tolerance:
    """When a solve ends: at this share of the norm of the right-hand side, or at this residual; it fails at `most`."""

    relative: float
    absolute: float
    most: int = MAX_ITERATIONS


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
    while np.linalg.norm(residual) > enough and iterations < tolerance.most:
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
    """Factors that are made anew when their last use took many iterations.

    They are dense: particles push on those two supports away, so that factors of a few thousand fill up anyhow.
    """

    def solve(
        self, operator: Apply, matrix: Callable[[], sparse.csr_matrix], right: Floats, tolerance: Tolerance
    ) -> Floats:
        """Solve A x = b from zero; `matrix` assembles A where new factors are needed.

        Raises:
            SolveFailed: the true residual stays above the limit, or A has no factors.
        """
        if self.origin is None or self.iterations > MANY_ITERATIONS or self.origin.shape[0] != len(right):
            self.origin, self._solver = matrix(), None
        fresh = self._solver is None
        try:
            most = MAX_ITERATIONS if fresh else TOO_MANY_ITERATIONS
            return self._solved(operator, right, replace(tolerance, most=most))
        except SolveFailed:
            if fresh:
                raise
        self.origin, self._solver = matrix(), None
        return self._solved(operator, right, tolerance)

    def _solved(self, operator: Apply, right: Floats, tolerance: Tolerance) -> Floats:
        """Solve with the factors of the matrix that is kept."""
        if self.origin is not None and self._solver is None:
            self._solver = _factored(self.origin)
        factors = self._solver

        def precondition(residual: Floats) -> Floats:
            return linalg.cho_solve(factors, residual, check_finite=False)

        start = np.zeros_like(right)
        solution, self.iterations = conjugate_gradients(operator, right, start, precondition, tolerance)
        return solution


def _factored(matrix: sparse.csr_matrix) -> tuple[Floats, bool]:
    """Factors of a symmetric positive semidefinite matrix, shifted."""
    dense = matrix.toarray(order="F")
    dense[np.diag_indices_from(dense)] += SHIFT * dense.diagonal().mean()
    try:
        return linalg.cho_factor(dense, lower=True, overwrite_a=True, check_finite=False)
    except linalg.LinAlgError as error:
        raise SolveFailed(f"Cholesky factors of {len(dense)} pressures: {error}") from error
