"""The pressure equation's matrix, B (m / dt + dt K)^-1 B^T: rows of B by particle, the rest low in rank.

B = G + v u^T: rates of volume G that are sparse, and what they miss of the rate of the whole, u, shared out by v. With
the factors of m / dt + dt K but for rigid motions, S, and Woodbury's formula for these, S^-1 - X c X^T with X = S^-1 Y,

    B (S^-1 - X c X^T) B^T = G S^-1 G^T + v z^T + z v^T + (u . S^-1 u) v v^T - (B X) c (B X)^T,     z = G S^-1 u.

So an application passes over G twice and solves once, whatever else there is.
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
    """Rates of volume of n particles' velocities, those that walls admit, as rows of pairs.

    Attributes:
        starts: of the rows, `(n + 1,)`.
        columns: particle of each pair, once a row.
        entries: `(k, 3)` gradient by its velocity [m^2].
    """

    starts: NDArray[np.int64]
    columns: Indices
    entries: Floats

    def band(self, stiffness: Floats, order: NDArray[np.int64]) -> Band:
        """G D^-1 G^T of a diagonal D `(n, 3)` [kg/s], in an order of the rows `(n,)` that makes it a band."""
        rows, scale = _banded(self.starts, self.columns, self.entries, 1.0 / np.sqrt(stiffness), order)
        return Band(rows, scale, order)


@dataclass(frozen=True, slots=True)
class SchurComplement:
    """The matrix of n pressures.

    Attributes:
        rates: G, its columns in the order of S.
        inertia: m / dt + dt K.
        low, across: `(n, r)` and `(r, n)`, whose product is what is low in rank.
    """

    rates: VolumeRateRows
    inertia: EffectiveMass
    low: Floats
    across: Floats

    @classmethod
    def of(
        cls, rates: VolumeRateRows, missed: tuple[Floats, Floats], inertia: EffectiveMass, more: tuple[Floats, Floats]
    ) -> Self:
        """Join them.

        Args:
            rates: G.
            missed: shares `(n,)` and gradient by velocities that walls admit `(n, 3)` [m^2]: v and u.
            inertia: what resists velocities.
            more: columns `(n, k)` and core `(k, k)` of anything else.
        """
        count, size = len(rates.starts) - 1, len(inertia.factors.order)
        place = np.arange(count, dtype=np.int32)
        place[inertia.factors.order[::3] // 3] = np.arange(size // 3, dtype=np.int32)
        shares, gradient = missed[0], missed[1].reshape(-1, 1)
        answer = inertia.bare(gradient)
        fields = np.concatenate((answer, inertia.moved), axis=1)
        moved = _rates_of_all(rates.starts, rates.columns, rates.entries, fields)
        moved[:, 1:] += np.outer(shares, gradient[:, 0] @ inertia.moved)
        low, last, pairs = np.column_stack((shares, moved, more[0])), 2 + len(inertia.core), more[1]
        core = np.zeros((low.shape[1],) * 2)
        core[0, 0], core[0, 1], core[1, 0] = gradient[:, 0] @ answer[:, 0], 1.0, 1.0
        core[2:last, 2:last], core[last:, last:] = -inertia.core, pairs
        ordered = VolumeRateRows(rates.starts, place[rates.columns], rates.entries)
        return cls(ordered, inertia, low, core @ low.T)

    def __call__(self, pressure: Floats) -> Floats:
        """Rates of volume `(n,)` under pressures `(n,)`."""
        rates, inertia, size = self.rates, self.inertia, len(self.inertia.factors.order)
        forces = _forces(rates.starts, rates.columns, rates.entries, pressure)
        forces[size:] /= inertia.inertia[size:]
        forces[:size] = lapack.dpbtrs(inertia.factors.root, forces[:size], lower=0, overwrite_b=1)[0]
        reached = _rates(rates.starts, rates.columns, rates.entries, forces)
        return reached + self.low @ (self.across @ pressure)


@njit(cache=True, fastmath={"contract"})
def _rates(starts, columns, entries, field):
    """G v `(n,)` of a velocity `(3 n,)` by particle."""
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
    """The same of m velocities `(3 n, m)`, `(n, m)`."""
    result = np.zeros((starts.shape[0] - 1, fields.shape[1]))
    for i in range(result.shape[0]):
        for k in range(starts[i], starts[i + 1]):
            at, x, y, z = 3 * columns[k], entries[k, 0], entries[k, 1], entries[k, 2]
            for m in range(fields.shape[1]):
                result[i, m] += x * fields[at, m] + y * fields[at + 1, m] + z * fields[at + 2, m]
    return result


@njit(cache=True, fastmath={"contract"})
def _forces(starts, columns, entries, pressure):
    """G^T p `(3 n,)` of pressures `(n,)`."""
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
    """Entries times a root by the particle of their column, those of each in an order of the rows, of length one each.

    Firsts `(n + 1,)`, ranks of the rows, entries `(k, 3)`; place among these of each pair; lengths that the rows had;
    how far apart the ranks of one particle are at most.
    """
    count = starts.shape[0] - 1
    firsts = np.zeros(count + 1, np.int64)
    for j in columns:
        firsts[j + 1] += 1
    firsts = np.cumsum(firsts)
    fill, rank, places = firsts.copy(), np.empty(columns.shape[0], np.int32), np.empty(columns.shape[0], np.int64)
    result, lengths, width = np.empty((columns.shape[0], 3), np.float32), np.empty(count), 0
    for r in range(count):
        row, square = order[r], 0.0
        for k in range(starts[row], starts[row + 1]):
            for c in range(3):
                square += (entries[k, c] * roots[columns[k], c]) ** 2
        lengths[row] = np.sqrt(square)
        for k in range(starts[row], starts[row + 1]):
            j = columns[k]
            rank[fill[j]], places[k] = r, fill[j]
            for c in range(3):
                result[fill[j], c] = entries[k, c] * roots[j, c] / lengths[row]
            width = max(width, r - rank[firsts[j]])
            fill[j] += 1
    return firsts, rank, result, places, lengths, width


@njit(cache=True, parallel=True)
def _banded(starts, columns, entries, roots, order):
    """Band, in single precision, of G D^-1 G^T, roots `(n, 3)` of D^-1, and its scale `(n,)`; `Band` says how."""
    firsts, rank, parts, places, lengths, width = _by_particle(starts, columns, entries, roots, order)
    count = order.shape[0]
    band = np.zeros((count, width + 1), np.float32)
    for r in prange(count):
        line, shift = band[r], width - r
        for k in range(starts[order[r]], starts[order[r] + 1]):
            own = places[k]
            x, y, z = parts[own, 0], parts[own, 1], parts[own, 2]
            for a in range(firsts[columns[k]], own + 1):
                line[rank[a] + shift] += x * parts[a, 0] + y * parts[a, 1] + z * parts[a, 2]
    return band, 1.0 / lengths
