"""Stencils of moving least squares: Cholesky factors of their small dense systems, and the check that these exist."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.particles.core.body import Body

PIVOT_FLOOR = 1e-9


class DegenerateStencil(ArithmeticError):
    """A particle has too few neighbours to fit a gradient."""


def check_stencils(body: Body, sound: NDArray[np.bool_], trouble: str) -> None:
    """Refuse particles `(n,)` whose stencils are not sound; the message names the first and its trouble.

    Raises:
        DegenerateStencil: there is one.
    """
    if not sound.all():
        worst = int(np.argmin(sound))
        place = ", ".join(f"{coordinate:.4g}" for coordinate in body.points[worst])
        raise DegenerateStencil(f"particle {worst} at ({place}) m {trouble}")


@njit(cache=True)
def factor_spd(matrix, size):
    """Cholesky factor in place, lower triangle; False where a pivot vanishes (too few neighbours)."""
    floor = 0.0
    for a in range(size):
        floor = max(floor, PIVOT_FLOOR * matrix[a, a])
    for a in range(size):
        for b in range(a + 1):
            for c in range(b):
                matrix[a, b] -= matrix[a, c] * matrix[b, c]
            if b < a:
                matrix[a, b] /= matrix[b, b]
        if matrix[a, a] <= floor:
            return False
        matrix[a, a] = np.sqrt(matrix[a, a])
    return True


@njit(cache=True)
def substitute(factor, right, size):
    """Solve in place for all columns of right with a Cholesky factor."""
    for col in range(right.shape[1]):
        for a in range(size):
            for c in range(a):
                right[a, col] -= factor[a, c] * right[c, col]
            right[a, col] /= factor[a, a]
        for a in range(size - 1, -1, -1):
            for c in range(a + 1, size):
                right[a, col] -= factor[c, a] * right[c, col]
            right[a, col] /= factor[a, a]
