"""Effective mass of a step, m / dt + dt K: masses and implicit surface tension, factored."""

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
    """Cholesky factors of a sparse matrix of shape (s, s), stored as a band.

    In reverse Cuthill-McKee order the neighbours of a surface point lie within a strip across the surface. The band
    routines of LAPACK factor and solve two to three times as fast as general sparse solvers.

    Attributes:
        order: Row of the matrix of each row of the band, shape (s,).
        root: R of R^T R, by diagonals in LAPACK's layout, shape (b + 1, s).
    """

    order: NDArray[np.int64]
    root: Floats

    @classmethod
    def of(cls, diagonal: Floats, factor: float, stiffness: sparse.bsr_matrix) -> Self:
        """Factor a diagonal plus a multiple of a block matrix.

        Args:
            diagonal: Diagonal, shape (s,).
            factor: Factor of the block matrix.
            stiffness: Symmetric matrix of square blocks, shape (s, s).

        Raises:
            SolveFailed: The sum is not positive definite.
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
        """Solve for right-hand sides of shape (s,) or (s, l)."""
        solution = np.empty_like(load)
        solution[self.order] = lapack.dpbtrs(self.root, load[self.order], lower=0, overwrite_b=1)[0]
        return solution


@njit(cache=True)
def _band(diagonal, factor, matrix, order):
    """Return the upper band of a diagonal plus a multiple of a block matrix, column by column, shape (s, b + 1)."""
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
    """Effective mass m / dt + dt P^T K P of d velocity components, with K on the first s.

    P removes the mass-orthonormal rigid-body motions R: P^T K P = K - m R^T R K - K R^T R m + m R^T R K R^T R m.

    Attributes:
        inertia: Masses over the time step, m / dt, shape (d,) [kg/s].
        factors: Factors of m / dt + dt K, shape (s, s).
        across: Columns m R^T and K R^T, shape (d, 2 k).
        moved: Solutions for these columns, shape (d, 2 k).
        core: Core matrix of Woodbury's formula, shape (2 k, 2 k).
    """

    inertia: Floats
    factors: BandedCholesky
    across: Floats
    moved: Floats
    core: Floats

    @classmethod
    def of(cls, masses: Floats, stiffness: sparse.bsr_matrix, rigid: Floats, time_step: float) -> "EffectiveMass":
        """Factor the effective mass.

        Args:
            masses: Masses, shape (d,) [kg].
            stiffness: Stiffness K, shape (s, s) [N/m].
            rigid: Mass-orthonormal rigid-body motions R, shape (k, d) [1/sqrt(kg)].
            time_step: Time step [s].

        Raises:
            SolveFailed: Negative stiffness outweighs the masses.
        """
        inertia, size, count = masses / time_step, stiffness.shape[0], len(rigid)
        factors = BandedCholesky.of(inertia[:size], time_step, stiffness)
        pull = np.zeros_like(rigid)
        pull[:, :size] = (stiffness @ rigid[:, :size].T).T
        across = np.concatenate((masses * rigid, pull)).T
        without = cls(inertia, factors, across[:, :0], across[:, :0], np.zeros((0, 0)))
        pulled, unit = without.solve_unconstrained(pull.T), np.eye(count)
        moved = np.concatenate((time_step * (rigid - time_step * pulled.T), pulled.T)).T
        inner = np.block([[np.zeros((count, count)), -unit], [-unit, -pull @ rigid.T]]) / time_step
        return cls(inertia, factors, across, moved, np.linalg.inv(inner + across.T @ moved))

    def solve(self, load: Floats) -> Floats:
        """Return the velocities [m/s] that loads [N] of shape (d,) or (d, l) cause in a time step."""
        first = self.solve_unconstrained(load)
        return first - self.moved @ (self.core @ (self.across.T @ first))

    def solve_unconstrained(self, load: Floats) -> Floats:
        """Solve with K instead of P^T K P, so that tension resists rigid-body motions, too."""
        size = len(self.factors.order)
        first = (load.T / self.inertia).T
        first[:size] = self.factors.solve(load[:size])
        return first
