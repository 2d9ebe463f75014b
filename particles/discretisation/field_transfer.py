"""Velocity of particles that were put elsewhere: read off the tetrahedra, momentum kept, kinetic energy not raised.

A particle that is shifted is another material point. It takes the velocity there, linear in the tetrahedron that lies
in the direction of the shift: a mean of old values, so that repeated shifts stay bounded.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.tetrahedra import cell_volumes, thick_cells, volume_gradients


def interpolation(points: Floats, cells: Indices, offset: Floats) -> sparse.csr_matrix:
    """Values at `points + offset` of what is linear in the tetrahedra, `(n, n)`; rows add up to one.

    Args:
        points: `(n, 3)` corners of the tetrahedra [m].
        cells: `(t, 4)`.
        offset: `(n, 3)` from the corners, short against the tetrahedra [m].
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
    """From particles and their masses before to those after a shift.

    Attributes:
        values: `(n, n)` interpolation.
        before, after: mass matrices `(n, n)` [m^3].
        translations: three `(n, 3)` fields, the translations that walls and edges admit.
    """

    values: sparse.csr_matrix
    before: sparse.csr_matrix
    after: sparse.csr_matrix
    translations: Sequence[Floats]

    def __call__(self, velocity: Floats) -> Floats:
        """Velocities `(n, 3)` with the old momentum along the translations, and no more energy than before."""
        new = self.values @ velocity
        weighted = [self.after @ field for field in self.translations]
        masses = np.array([[float((a * b).sum()) for b in self.translations] for a in weighted])
        momentum = self.before @ velocity
        wanted = np.array([float((field * momentum).sum()) for field in self.translations])
        found = np.array([float((a * new).sum()) for a in weighted])

        def translation(amount: Floats) -> Floats:
            return sum(c * field for c, field in zip(np.linalg.solve(masses, amount), self.translations, strict=True))

        mean, fluctuation = translation(wanted), new - translation(found)
        available = float((velocity * momentum).sum()) - float((mean * (self.after @ mean)).sum())
        energy = float((fluctuation * (self.after @ fluctuation)).sum())
        if energy > available:
            fluctuation *= np.sqrt(max(available, 0.0) / energy)
        return mean + fluctuation
