"""Conjugate gradients without a matrix, and preconditioned with the factors of an earlier step's matrix."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import SolveFailed

Apply = Callable[[Floats], Floats]
Singles = NDArray[np.float32]
MAX_ITERATIONS = 500
# Of the norm of the right-hand side: more than this is no solution.
RESIDUAL_LIMIT = 1e-4
# A step takes six with new factors, twelve with the last step's and twice as many with those before; new ones cost as
# much as fifteen of 1331 pressures.
MANY_ITERATIONS = 8
# With factors of another matrix: where these do not do, new ones cost less than to go on.
TOO_MANY_ITERATIONS = 30
# Added to the diagonal, which is about one, in the factors only: pressures from particle to particle hardly show.
SHIFT = 1e-6
SAVED = ("root", "scale", "order", "iterations")


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


@dataclass(frozen=True, slots=True)
class Band:
    """A symmetric matrix A, scaled and in an order in which its entries lie next to the diagonal.

    Attributes:
        rows: of S A S, from b places before the diagonal to it, `(n, b + 1)`.
        scale: S, `(n,)`.
        order: `(n,)` which row of A each row is.
    """

    rows: Singles
    scale: Floats
    order: NDArray[np.int64]

    @classmethod
    def of(cls, matrix: Floats) -> "Band":
        """Of a matrix `(n, n)` without zeros, scaled to a diagonal of one."""
        count, scale = len(matrix), 1.0 / np.sqrt(matrix.diagonal())
        rows = np.zeros((count, count), np.float32)
        for i, row in enumerate(scale[:, None] * matrix * scale):
            rows[i, count - 1 - i :] = row[: i + 1]
        return cls(rows, scale, np.arange(count))


@dataclass(slots=True)
class LaggedCholesky:
    """Factors of an earlier matrix, made anew when their last use took many iterations.

    They fill a band: particles push on those two supports away. Single precision is enough to precondition with, and
    half the memory twice as fast.

    Attributes:
        root: R of R^T R = S A S, by diagonals as LAPACK has them, `(b + 1, n)`.
        scale: S, `(n,)`, by row of R.
        order: `(n,)` which row of A each row of R is.
        iterations: of the last solve.
    """

    root: Singles | None = None
    scale: Floats | None = None
    order: NDArray[np.int64] | None = None
    iterations: int = 0

    def solve(self, operator: Apply, matrix: Callable[[], Band], right: Floats, tolerance: Tolerance) -> Floats:
        """Solve A x = b from zero; `matrix` makes A where new factors are needed.

        Raises:
            SolveFailed: the true residual stays above the limit, or A has no factors.
        """
        fresh = self.scale is None or self.iterations > MANY_ITERATIONS or len(self.scale) != len(right)
        if fresh:
            self._factor(matrix())
        try:
            most = MAX_ITERATIONS if fresh else TOO_MANY_ITERATIONS
            return self._solved(operator, right, replace(tolerance, most=most))
        except SolveFailed:
            if fresh:
                raise
        self._factor(matrix())
        return self._solved(operator, right, tolerance)

    def _factor(self, matrix: Band) -> None:
        """Factor a matrix, whose rows are overwritten."""
        matrix.rows[:, -1] += SHIFT
        root, failed = lapack.spbtrf(matrix.rows.T, lower=0, overwrite_ab=1)
        if failed:
            raise SolveFailed(f"Cholesky factors of {len(matrix.order)} pressures: pivot {failed} is not positive")
        self.root, self.scale, self.order = root, matrix.scale[matrix.order], matrix.order

    def _solved(self, operator: Apply, right: Floats, tolerance: Tolerance) -> Floats:
        """Solve with the factors that are kept."""
        root, scale, order = self.root, self.scale, self.order
        assert scale is not None

        def precondition(residual: Floats) -> Floats:
            found = np.empty_like(residual)
            scaled = (scale * residual[order]).astype(np.float32)
            found[order] = scale * lapack.spbtrs(root, scaled, lower=0, overwrite_b=1)[0]
            return found

        start = np.zeros_like(right)
        solution, self.iterations = conjugate_gradients(operator, right, start, precondition, tolerance)
        return solution

    def saved(self) -> dict[str, Any]:
        """All of it, for a checkpoint."""
        return {name: getattr(self, name) for name in SAVED}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        for name in SAVED:
            setattr(self, name, saved[name])
        if self.root is not None:
            self.root = np.asfortranarray(self.root)
