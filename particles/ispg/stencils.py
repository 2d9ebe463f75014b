"""Stencils of moving least squares: Cholesky factors of their small dense systems, and a check of degeneracy."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.particles.core.body import Body

PIVOT_FLOOR = 1e-9


class DegenerateStencil(ArithmeticError):
    """Error of a particle with too few neighbours, or neighbours in a plane, to fit a gradient."""


def check_stencils(body: Body, sound: NDArray[np.bool_], trouble: str) -> None:
    """Raise an error if the stencil (the neighbours from which gradients are fitted) of a particle is degenerate.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        sound: Whether the stencil of each particle is sound, shape (n,).
        trouble: Predicate of the message, e.g. "has fewer than 16 neighbours".

    Raises:
        DegenerateStencil: A stencil is not sound; the message names the first such particle and its position.
    """
    if not sound.all():
        worst = int(np.argmin(sound))
        position = ", ".join(f"{coordinate:.4g}" for coordinate in body.points[worst])
        raise DegenerateStencil(f"particle {worst} at ({position}) m {trouble}")


@njit(cache=True)
def factor_spd(matrix, size):
    """Factor a symmetric positive definite matrix in place by Cholesky's method.

    Args:
        matrix: Matrix, a real array of shape (>= size, >= size), changed in place; the lower triangle of its leading
            block is replaced by the factor L.
        size: Number of rows and columns in use, integer.

    Returns:
        True, or False if a pivot vanishes; the contents are then undefined.
    """
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
    """Solve A X = B with a Cholesky factor of A, for all columns of B; the solutions replace B.

    Args:
        factor: Array with the factor L of A = L L^T in the lower triangle of its leading block, shape (>= size, >=
            size).
        right: Right-hand sides, shape (>= size, columns), replaced by the solutions.
        size: Number of equations, integer.
    """
    for col in range(right.shape[1]):
        for a in range(size):
            for c in range(a):
                right[a, col] -= factor[a, c] * right[c, col]
            right[a, col] /= factor[a, a]
        for a in range(size - 1, -1, -1):
            for c in range(a + 1, size):
                right[a, col] -= factor[c, a] * right[c, col]
            right[a, col] /= factor[a, a]
