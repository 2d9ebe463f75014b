"""Conjugate gradients without a matrix, and preconditioned with the factors of an earlier step's matrix."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import SolveFailed

Apply = Callable[[Floats], Floats]
Singles = NDArray[np.float32]
MAX_ITERATIONS = 500
# Of the norm of the right-hand side: more than this is no solution.
RESIDUAL_LIMIT = 1e-4
# A step takes four with new factors, fourteen with the last step's and twice as many with those before; the former cost
# as much as ten of 216 pressures, fifty of 1331.
MANY_ITERATIONS = 12
# With factors of another matrix: where these do not do, new ones cost less than to go on.
TOO_MANY_ITERATIONS = 80
# Added to the diagonal, which is about one, in the factors only: pressures from particle to particle hardly show.
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
    """Solve A x = b for a symmetric positive semidefinite A, b in its range.

    Args:
        operator: x -> A x.
        right: b, `(d,)`, or of another shape.
        start: x to start with, shaped as b.
        precondition: r -> P^-1 r.
        tolerance: when it ends.

    Returns:
        x, and the iterations.

    Raises:
        SolveFailed: the true residual stays above the limit.
    """
    norm = _length(right)
    enough = max(tolerance.relative * norm, tolerance.absolute)
    solution = start.copy()
    residual = right - operator(solution) if start.any() else right.copy()
    direction, product, iterations = np.zeros_like(right), 1.0, 0
    while _length(residual) > enough and iterations < tolerance.most:
        scaled = precondition(residual)
        before, product = product, float(np.vdot(residual, scaled))
        direction = scaled + (product / before if iterations else 0.0) * direction
        image = operator(direction)
        length = product / float(np.vdot(direction, image))
        solution += length * direction
        residual -= length * image
        iterations += 1
    left = _length(right - operator(solution)) if iterations else 0.0
    if not left <= max(RESIDUAL_LIMIT * norm, 2.0 * enough):
        raise SolveFailed(f"conjugate gradients: relative residual {left / norm:.2e} after {iterations} iterations")
    return solution, iterations


def _length(values: Floats) -> float:
    return float(np.sqrt(np.vdot(values, values)))


@dataclass(slots=True)
class LaggedCholesky:
    """Factors of an earlier matrix, made anew when their last use took many iterations.

    They are dense: particles push on those two supports away, so that factors of a few thousand fill up anyhow. Single
    precision is enough to precondition with, and half the memory twice as fast.

    Attributes:
        root: R of R^T R = S A S, `(n, n)`, upper triangle.
        scale: S, `(n,)`.
        iterations: of the last solve.
    """

    root: Singles | None = None
    scale: Floats | None = None
    iterations: int = 0

    def solve(
        self, operator: Apply, matrix: Callable[[], tuple[Singles, Floats]], right: Floats, tolerance: Tolerance
    ) -> Floats:
        """Solve A x = b from zero; `matrix` makes the lower triangle of S A S, and S, where new factors are needed.

        Raises:
            SolveFailed: the true residual stays above the limit, or A has no factors.
        """
        fresh = self.scale is None or self.iterations > MANY_ITERATIONS or len(self.scale) != len(right)
        if fresh:
            self.root, self.scale = _factored(*matrix())
        try:
            most = MAX_ITERATIONS if fresh else TOO_MANY_ITERATIONS
            return self._solved(operator, right, replace(tolerance, most=most))
        except SolveFailed:
            if fresh:
                raise
        self.root, self.scale = _factored(*matrix())
        return self._solved(operator, right, tolerance)

    def _solved(self, operator: Apply, right: Floats, tolerance: Tolerance) -> Floats:
        """Solve with the factors that are kept."""
        root, scale = self.root, self.scale
        assert scale is not None

        def precondition(residual: Floats) -> Floats:
            # One right-hand side: the routine for many (potrs) takes four times as long.
            scaled = (scale * residual).astype(np.float32)
            return scale * blas.strsv(root, blas.strsv(root, scaled, trans=1), overwrite_x=1)

        start = np.zeros_like(right)
        solution, self.iterations = conjugate_gradients(operator, right, start, precondition, tolerance)
        return solution

    def saved(self) -> dict[str, Any]:
        """All of it, for a checkpoint."""
        root = None if self.root is None else self.root[np.triu_indices(len(self.root))]
        return {"root": root, "scale": self.scale, "iterations": self.iterations}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        self.scale, self.iterations, self.root = saved["scale"], saved["iterations"], None
        if self.scale is not None:
            self.root = np.zeros((len(self.scale),) * 2, np.float32, order="F")
            self.root[np.triu_indices(len(self.scale))] = saved["root"]


def _factored(matrix: Singles, scale: Floats) -> tuple[Singles, Floats]:
    """Root of a shifted matrix, of which the lower triangle is given, in its place; and its scale."""
    matrix[np.diag_indices_from(matrix)] += SHIFT
    root, failed = lapack.spotrf(matrix.T, lower=0, overwrite_a=1, clean=0)
    if failed:
        raise SolveFailed(f"Cholesky factors of {len(scale)} pressures: pivot {failed} is not positive")
    return root, scale
