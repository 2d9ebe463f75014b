"""Matrix-free conjugate gradients, preconditioned by the banded Cholesky factors of an earlier step's matrix."""

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
# Relative residual above which a solve has failed.
RESIDUAL_LIMIT = 1e-4
# Number of iterations above which the factors are renewed. A step takes six iterations with new factors, twelve with
# the factors of the last step and 24 with older factors; new factors cost fifteen iterations with 1331 pressures.
MANY_ITERATIONS = 8
# Number of iterations with old factors after which new ones cost less than to continue.
TOO_MANY_ITERATIONS = 30
# Added to the diagonal of one in the factors only: pressures that alternate from particle to particle are nearly
# singular.
SHIFT = 1e-6
SAVED = ("root", "scale", "order", "iterations")


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Tolerance of a solve.

    Attributes:
        relative: Residual over the norm of the right-hand side at which the solve ends.
        absolute: Residual at which the solve ends.
        most: Number of iterations after which it fails.
    """

    relative: float
    absolute: float
    most: int = MAX_ITERATIONS


def conjugate_gradients(
    operator: Apply, right: Floats, start: Floats, precondition: Apply, tolerance: Tolerance
) -> tuple[Floats, int]:
    """Solve A x = b by conjugate gradients, for a symmetric positive semidefinite A with b in its range.

    Args:
        operator: Function x -> A x.
        right: Right-hand side b, of any shape.
        start: Initial guess of x, shaped as b.
        precondition: Function r -> P^-1 r that applies the preconditioner to a residual.
        tolerance: Relative and absolute limit of the residual norm, and largest number of iterations.

    Returns:
        Solution x and the number of iterations.

    Raises:
        SolveFailed: The true residual exceeds the limit.
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
    """Symmetric matrix A, scaled and ordered so that its entries lie near the diagonal.

    Attributes:
        rows: Lower band of S A S, from b entries before the diagonal to it, shape (n, b + 1).
        scale: Diagonal of S, shape (n,).
        order: Row of A of each row of the band, shape (n,).
    """

    rows: Singles
    scale: Floats
    order: NDArray[np.int64]

    @classmethod
    def of(cls, matrix: Floats) -> "Band":
        """Return the full band of a dense symmetric matrix, shape (n, n), scaled to a unit diagonal."""
        count, scale = len(matrix), 1.0 / np.sqrt(matrix.diagonal())
        rows = np.zeros((count, count), np.float32)
        for i, row in enumerate(scale[:, None] * matrix * scale):
            rows[i, count - 1 - i :] = row[: i + 1]
        return cls(rows, scale, np.arange(count))


@dataclass(slots=True)
class LaggedCholesky:
    """Conjugate gradients with the Cholesky factors of an earlier matrix, renewed after a solve with many iterations.

    The factors are banded, because particles interact up to two supports away. Single precision is sufficient for a
    preconditioner and twice as fast.

    Attributes:
        root: R of R^T R = S A S, by diagonals in LAPACK's layout, shape (b + 1, n).
        scale: Diagonal of S by row of R, shape (n,).
        order: Row of A of each row of R, shape (n,).
        iterations: Number of iterations of the last solve.
    """

    root: Singles | None = None
    scale: Floats | None = None
    order: NDArray[np.int64] | None = None
    iterations: int = 0

    def solve(self, operator: Apply, matrix: Callable[[], Band], right: Floats, tolerance: Tolerance) -> Floats:
        """Solve A x = b with a zero initial guess.

        Args:
            operator: Function x -> A x.
            matrix: Function that assembles A or an approximation of it when new factors are needed.
            right: Right-hand side b, shape (n,).
            tolerance: Tolerance of the residual.

        Returns:
            Solution x, shape (n,).

        Raises:
            SolveFailed: The true residual exceeds the limit, or A has no Cholesky factors.
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
        """Factor a matrix; its rows are overwritten."""
        matrix.rows[:, -1] += SHIFT
        root, failed = lapack.spbtrf(matrix.rows.T, lower=0, overwrite_ab=1)
        if failed:
            raise SolveFailed(f"Cholesky factors of {len(matrix.order)} pressures: pivot {failed} is not positive")
        self.root, self.scale, self.order = root, matrix.scale[matrix.order], matrix.order

    def _solved(self, operator: Apply, right: Floats, tolerance: Tolerance) -> Floats:
        """Solve with the current factors."""
        root, scale, order = self.root, self.scale, self.order
        assert scale is not None

        def precondition(residual: Floats) -> Floats:
            result = np.empty_like(residual)
            scaled = (scale * residual[order]).astype(np.float32)
            result[order] = scale * lapack.spbtrs(root, scaled, lower=0, overwrite_b=1)[0]
            return result

        start = np.zeros_like(right)
        solution, self.iterations = conjugate_gradients(operator, right, start, precondition, tolerance)
        return solution

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps."""
        return {name: getattr(self, name) for name in SAVED}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        for name in SAVED:
            setattr(self, name, saved[name])
        if self.root is not None:
            self.root = np.asfortranarray(self.root)
