"""Velocity of shifted particles: interpolated in the tetrahedra, with momentum kept and no gain of kinetic energy.

A shifted particle is another material point. It takes the velocity at its new position, linear in the tetrahedron that
lies in the direction of the shift: a mean of old values, so that repeated shifts stay bounded.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.tetrahedra import cell_volumes, thick_cells, volume_gradients


def interpolation_matrix(points: Floats, cells: Indices, offset: Floats) -> sparse.csr_matrix:
    """Return the matrix that interpolates nodal values at ``points + offset``, linearly in tetrahedra; rows sum to one.

    Args:
        points: Corners of the tetrahedra, shape (n, 3) [m].
        cells: Tetrahedra, shape (t, 4).
        offset: Offsets from the corners, short compared with the tetrahedra, shape (n, 3) [m].

    Returns:
        Sparse matrix, shape (n, n).
    """
    count, volumes = len(points), cell_volumes(points, cells)
    thick = thick_cells(volumes)
    cells = cells[thick]
    slopes = volume_gradients(points, cells) / volumes[thick][:, None, None]
    change = np.einsum("tcd,tjd->tcj", offset[cells], slopes)
    inwardness = np.where(np.eye(4, dtype=bool), np.inf, change).min(axis=2)
    order = np.lexsort((-inwardness.ravel(), cells.ravel()))
    particle, first = np.unique(cells.ravel()[order], return_index=True)
    cell, corner = np.divmod(order[first], 4)
    rows, columns = np.repeat(particle, 4), cells[cell].ravel()
    moved = sparse.csr_matrix((change[cell, corner].ravel(), (rows, columns)), shape=(count, count))
    return (sparse.identity(count) + moved).tocsr()


@dataclass(frozen=True, slots=True)
class Transfer:
    """Transfer of velocities from particles before a shift to particles and masses after it.

    Attributes:
        values: Interpolation, shape (n, n).
        before: Mass matrix before the shift over the density, shape (n, n) [m^3].
        after: Mass matrix after the shift over the density, shape (n, n) [m^3].
        translations: Translations that walls and edges admit, at most three fields of shape (n, 3).
    """

    values: sparse.csr_matrix
    before: sparse.csr_matrix
    after: sparse.csr_matrix
    translations: Sequence[Floats]

    def __call__(self, velocity: Floats) -> Floats:
        """Transfer velocities, shape (n, 3) [m/s], with the old momentum and no gain of energy."""
        new = self.values @ velocity
        weighted = [self.after @ field for field in self.translations]
        masses = np.array([[float((a * b).sum()) for b in self.translations] for a in weighted])
        momentum = self.before @ velocity
        required = np.array([float((field * momentum).sum()) for field in self.translations])
        interpolated = np.array([float((a * new).sum()) for a in weighted])

        def translation(amount: Floats) -> Floats:
            return sum(c * field for c, field in zip(np.linalg.solve(masses, amount), self.translations, strict=True))

        mean, fluctuation = translation(required), new - translation(interpolated)
        available = float((velocity * momentum).sum()) - float((mean * (self.after @ mean)).sum())
        energy = float((fluctuation * (self.after @ fluctuation)).sum())
        if energy > available:
            fluctuation *= np.sqrt(max(available, 0.0) / energy)
        return mean + fluctuation
