"""Masses and implicit surface tension, what a change of the velocity in a step has to overcome, factored."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.csgraph import reverse_cuthill_mckee

from reflowshock.arrays import Floats
from reflowshock.particles.discretisation.incompressibility import SolveFailed


@dataclass(frozen=True, slots=True)
class BandedCholesky:
    """Cholesky factors of a sparse matrix `(s, s)`, in an order in which they lie next to the diagonal.

    Points of a surface in the order of Cuthill and McKee have those around them within a strip across it. LAPACK
    factors and solves in such a band two to three times as fast as general sparse factors are made and used.

    Attributes:
        order: `(s,)` which row each row of the band is.
        root: R of R^T R, by diagonals as LAPACK has them, `(b + 1, s)`.
    """

    order: NDArray[np.int64]
    root: Floats

    @classmethod
    def of(cls, diagonal: Floats, factor: float, stiffness: sparse.bsr_matrix) -> Self:
        """Factor a diagonal `(s,)` and a symmetric matrix `(s, s)` times a factor, of square blocks.

        Raises:
            SolveFailed: the sum is not positive definite.
        """
        size = stiffness.blocksize[0]
        starts, columns = stiffness.indptr, stiffness.indices
        links = sparse.csr_matrix((np.ones(len(columns), np.int8), columns, starts), shape=(len(starts) - 1,) * 2)
        blocks = reverse_cuthill_mckee(links, symmetric_mode=True)
        order = (size * blocks[:, None].astype(np.int64) + np.arange(size)).ravel()
        band = _band(diagonal[order], factor, (starts, columns, stiffness.data), blocks)
        root, failed = lapack.dpbtrf(band.T, lower=0, overwrite_ab=1)
        if failed:
            raise SolveFailed(f"Cholesky factors of masses and surface tension: pivot {failed} is not positive")
        return cls(order, root)

    def solve(self, load: Floats) -> Floats:
        """Solve for right-hand sides `(s,)` or `(s, l)`."""
        found = np.empty_like(load)
        found[self.order] = lapack.dpbtrs(self.root, load[self.order], lower=0, overwrite_b=1)[0]
        return found


@njit(cache=True)
def _band(diagonal, factor, matrix, order):
    """Upper half of the band of a diagonal and a matrix of blocks times a factor, column by column `(s, b + 1)`."""
    starts, columns, blocks = matrix
    count, size = order.shape[0], blocks.shape[1]
    rank, width = np.empty(count, np.int64), 0
    for r in range(count):
        rank[order[r]] = r
    for i in range(count):
        for k in range(starts[i], starts[i + 1]):
            width = max(width, rank[columns[k]] - rank[i])
    width = size * width + size - 1
    band = np.zeros((count * size, width + 1))
    for r in range(count * size):
        band[r, width] = diagonal[r]
    for i in range(count):
        for k in range(starts[i], starts[i + 1]):
            for c in range(size):
                for d in range(size):
                    row, column = size * rank[i] + c, size * rank[columns[k]] + d
                    if row <= column:
                        band[column, width + row - column] += factor * blocks[k, c, d]
    return band


@dataclass(frozen=True, slots=True)
class EffectiveMass:
    """Masses and implicit surface tension of d velocities, m / dt + dt P^T K P, K of the first s.

    P takes out the rigid motions R, orthonormal by the masses: P^T K P = K - m R^T R K - K R^T R m + m R^T R K R^T R m.

    Attributes:
        inertia: m / dt `(d,)` [kg/s].
        factors: of m / dt + dt K, `(s, s)`.
        across: `(d, 2 k)` columns m R^T and K R^T.
        moved: `(d, 2 k)` these, solved for.
        core: `(2 k, 2 k)` of Woodbury's formula.
    """

    inertia: Floats
    factors: BandedCholesky
    across: Floats
    moved: Floats
    core: Floats

    @classmethod
    def of(cls, masses: Floats, stiffness: sparse.bsr_matrix, rigid: Floats, time_step: float) -> "EffectiveMass":
        """Factor masses `(d,)` [kg] and stiffness `(s, s)` [N/m] with rigid motions `(k, d)`, for a time step [s].

        Raises:
            SolveFailed: the stiffness outweighs the masses where it is negative.
        """
        inertia, size, count = masses / time_step, stiffness.shape[0], len(rigid)
        factors = BandedCholesky.of(inertia[:size], time_step, stiffness)
        pull = np.zeros_like(rigid)
        pull[:, :size] = (stiffness @ rigid[:, :size].T).T
        across = np.concatenate((masses * rigid, pull)).T
        without = cls(inertia, factors, across[:, :0], across[:, :0], np.zeros((0, 0)))
        pulled, unit = without.bare(pull.T), np.eye(count)
        moved = np.concatenate((time_step * (rigid - time_step * pulled.T), pulled.T)).T
        inner = np.block([[np.zeros((count, count)), -unit], [-unit, -pull @ rigid.T]]) / time_step
        return cls(inertia, factors, across, moved, np.linalg.inv(inner + across.T @ moved))

    def solve(self, load: Floats) -> Floats:
        """Velocities `(d,)` or `(d, l)` that loads reach in a time step."""
        first = self.bare(load)
        return first - self.moved @ (self.core @ (self.across.T @ first))

    def bare(self, load: Floats) -> Floats:
        """The same if tension resisted rigid motions, too."""
        size = len(self.factors.order)
        first = (load.T / self.inertia).T
        first[:size] = self.factors.solve(load[:size])
        return first
