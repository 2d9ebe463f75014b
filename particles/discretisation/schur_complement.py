"""Schur complement of the pressure equation, B (m/dt + dt K)^-1 B^T, as sparse rows plus a matrix of low rank.

B = G + v u^T has sparse rates of volume G; u is the part of the gradient of the enclosed volume that they miss, and v
distributes it. Let S be m/dt + dt K, and Woodbury's formula give the inverse without stiffness along rigid-body
motions as S^-1 - X c X^T with X = S^-1 Y. Then

    B (S^-1 - X c X^T) B^T = G S^-1 G^T + v z^T + z v^T + (u . S^-1 u) v v^T - (B X) c (B X)^T,     z = G S^-1 u,

so that one application passes over G twice and solves with S once.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy.linalg import lapack

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.discretisation.effective_mass import EffectiveMass
from reflowshock.particles.discretisation.lagged_cholesky import Band


@dataclass(frozen=True, slots=True)
class VolumeRateRows:
    """Sparse rows of G: rates of the volumes of n particles by admissible velocities.

    Attributes:
        starts: Start of each row, shape (n + 1,).
        columns: Particle of each entry, at most once per row, shape (k,).
        entries: Gradient by the velocity of that particle, shape (k, 3) [m^2].
    """

    starts: NDArray[np.int64]
    columns: Indices
    entries: Floats

    def band(self, stiffness: Floats, order: NDArray[np.int64]) -> Band:
        """Assemble G D^-1 G^T as a band matrix.

        Args:
            stiffness: Diagonal D, shape (n, 3) [kg/s].
            order: Order of the rows that makes the matrix a band, shape (n,).
        """
        rows, scale = _banded(self.starts, self.columns, self.entries, 1.0 / np.sqrt(stiffness), order)
        return Band(rows, scale, order)


@dataclass(frozen=True, slots=True)
class LowRank:
    """Symmetric matrix of low rank, columns core columns^T.

    Attributes:
        columns: Columns, shape (n, k).
        core: Symmetric core, shape (k, k).
    """

    columns: Floats
    core: Floats


@dataclass(frozen=True, slots=True)
class SchurComplement:
    """Matrix of the equation for n pressures.

    Attributes:
        rates: G, with columns in the order of the factors of S.
        inertia: Factored effective mass.
        low: Left factor of the part of low rank, shape (n, r).
        across: Right factor of that part, shape (r, n).
    """

    rates: VolumeRateRows
    inertia: EffectiveMass
    low: Floats
    across: Floats

    @classmethod
    def of(
        cls, rates: VolumeRateRows, shares: Floats, gradient: Floats, inertia: EffectiveMass, extra: LowRank
    ) -> Self:
        """Combine the sparse and the low-rank parts.

        Args:
            rates: Sparse rates of volume G.
            shares: Distribution v of the missing rate over the rows, shape (n,).
            gradient: Missing gradient u by admissible velocities, shape (n, 3) [m^2].
            inertia: Factored effective mass.
            extra: Further terms, e.g. of floating plates.
        """
        count, size = len(rates.starts) - 1, len(inertia.factors.order)
        position = np.arange(count, dtype=np.int32)
        position[inertia.factors.order[::3] // 3] = np.arange(size // 3, dtype=np.int32)
        gradient = gradient.reshape(-1, 1)
        answer = inertia.solve_unconstrained(gradient)
        fields = np.concatenate((answer, inertia.moved), axis=1)
        moved = _rates_of_all(rates.starts, rates.columns, rates.entries, fields)
        moved[:, 1:] += np.outer(shares, gradient[:, 0] @ inertia.moved)
        low, last = np.column_stack((shares, moved, extra.columns)), 2 + len(inertia.core)
        core = np.zeros((low.shape[1],) * 2)
        core[0, 0], core[0, 1], core[1, 0] = gradient[:, 0] @ answer[:, 0], 1.0, 1.0
        core[2:last, 2:last], core[last:, last:] = -inertia.core, extra.core
        ordered = VolumeRateRows(rates.starts, position[rates.columns], rates.entries)
        return cls(ordered, inertia, low, core @ low.T)

    def __call__(self, pressure: Floats) -> Floats:
        """Return the rates of volume that pressures of shape (n,) [Pa] cause, shape (n,) [m^3/s]."""
        rates, inertia, size = self.rates, self.inertia, len(self.inertia.factors.order)
        forces = _forces(rates.starts, rates.columns, rates.entries, pressure)
        forces[size:] /= inertia.inertia[size:]
        forces[:size] = lapack.dpbtrs(inertia.factors.root, forces[:size], lower=0, overwrite_b=1)[0]
        reached = _rates(rates.starts, rates.columns, rates.entries, forces)
        return reached + self.low @ (self.across @ pressure)


@njit(cache=True, fastmath={"contract"})
def _rates(starts, columns, entries, field):
    """Return G v, shape (n,), of a velocity by particle, shape (3 n,)."""
    result = np.empty(starts.shape[0] - 1)
    for i in range(result.shape[0]):
        total = 0.0
        for k in range(starts[i], starts[i + 1]):
            at = 3 * columns[k]
            total += entries[k, 0] * field[at] + entries[k, 1] * field[at + 1] + entries[k, 2] * field[at + 2]
        result[i] = total
    return result


@njit(cache=True, fastmath={"contract"})
def _rates_of_all(starts, columns, entries, fields):
    """Return G v, shape (n, m), of m velocities, shape (3 n, m)."""
    result = np.zeros((starts.shape[0] - 1, fields.shape[1]))
    for i in range(result.shape[0]):
        for k in range(starts[i], starts[i + 1]):
            at, x, y, z = 3 * columns[k], entries[k, 0], entries[k, 1], entries[k, 2]
            for m in range(fields.shape[1]):
                result[i, m] += x * fields[at, m] + y * fields[at + 1, m] + z * fields[at + 2, m]
    return result


@njit(cache=True, fastmath={"contract"})
def _forces(starts, columns, entries, pressure):
    """Return G^T p, shape (3 n,), of pressures, shape (n,)."""
    result = np.zeros(3 * pressure.shape[0])
    for i in range(pressure.shape[0]):
        p = pressure[i]
        for k in range(starts[i], starts[i + 1]):
            at = 3 * columns[k]
            result[at] += p * entries[k, 0]
            result[at + 1] += p * entries[k, 1]
            result[at + 2] += p * entries[k, 2]
    return result


@njit(cache=True)
def _by_particle(starts, columns, entries, roots, order):
    """Return G D^-1/2 by column, with rows in a given order and normalised to length one.

    Args:
        starts: Start of each row of G, shape (n + 1,).
        columns: Particle of each entry, shape (k,).
        entries: Entries of G, shape (k, 3).
        roots: Diagonal of D^-1/2, shape (n, 3).
        order: Order of the rows, shape (n,).

    Returns:
        Start of each column, shape (n + 1,); rank of the row of each entry, shape (k,); entries, shape (k, 3); position
        of each entry of G among these, shape (k,); lengths of the rows before, shape (n,); and the bandwidth.
    """
    count = starts.shape[0] - 1
    firsts = np.zeros(count + 1, np.int64)
    for j in columns:
        firsts[j + 1] += 1
    firsts = np.cumsum(firsts)
    fill, rank, positions = firsts.copy(), np.empty(columns.shape[0], np.int32), np.empty(columns.shape[0], np.int64)
    result, lengths, width = np.empty((columns.shape[0], 3), np.float32), np.empty(count), 0
    for r in range(count):
        row, square = order[r], 0.0
        for k in range(starts[row], starts[row + 1]):
            for c in range(3):
                square += (entries[k, c] * roots[columns[k], c]) ** 2
        lengths[row] = np.sqrt(square)
        for k in range(starts[row], starts[row + 1]):
            j = columns[k]
            rank[fill[j]], positions[k] = r, fill[j]
            for c in range(3):
                result[fill[j], c] = entries[k, c] * roots[j, c] / lengths[row]
            width = max(width, r - rank[firsts[j]])
            fill[j] += 1
    return firsts, rank, result, positions, lengths, width


@njit(cache=True, parallel=True)
def _banded(starts, columns, entries, roots, order):
    """Return rows and scale of ``Band`` for G D^-1 G^T in single precision; ``roots`` is D^-1/2, shape (n, 3)."""
    firsts, rank, parts, positions, lengths, width = _by_particle(starts, columns, entries, roots, order)
    count = order.shape[0]
    band = np.zeros((count, width + 1), np.float32)
    for r in prange(count):
        line, shift = band[r], width - r
        for k in range(starts[order[r]], starts[order[r] + 1]):
            entry = positions[k]
            x, y, z = parts[entry, 0], parts[entry, 1], parts[entry, 2]
            for a in range(firsts[columns[k]], entry + 1):
                line[rank[a] + shift] += x * parts[a, 0] + y * parts[a, 1] + z * parts[a, 2]
    return band, 1.0 / lengths
