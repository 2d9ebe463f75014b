"""Cholesky solution of the small dense systems of a stencil."""

import numpy as np
from numba import njit

PIVOT_FLOOR = 1e-9


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
