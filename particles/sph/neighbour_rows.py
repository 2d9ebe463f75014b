"""Who is beside whom: rows of neighbours, the liquid's first, kept until some particles have moved by the skin."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numba import njit, prange

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import have_moved, list_beside
from reflowshock.particles.sph.fluid_state import Law
from reflowshock.particles.sph.smoothing import SUPPORT

# Of the smoothing length: how far beyond their support particles are listed.
SKIN = 0.3


@njit(cache=True)
def liquid_first(row, fluids):
    """Put the particles of the liquid to the front of a row."""
    front = 0
    for k in range(row.shape[0]):
        if row[k] < fluids:
            row[front], row[k] = row[k], row[front]
            front += 1


@njit(cache=True, parallel=True)
def _all_liquid_first(rows, counts, fluids):
    for i in prange(rows.shape[0]):
        liquid_first(rows[i, : counts[i]], fluids)


@dataclass(slots=True)
class Rows:
    """Neighbours of every particle, those of the liquid first, found again when some have moved by the skin.

    Attributes:
        law: says support and periods.
        fluids: number of particles that are liquid; those of walls list them alone.
        built_at: `(3, n)` positions when they were found [m].
        lists: rows `(n, k)` and how many neighbours each begins with `(n,)`; a particle of the liquid is in its own.
        builds: how often they were found.
    """

    law: Law
    fluids: int
    built_at: Floats = field(default_factory=lambda: np.empty((3, 0)))
    lists: tuple[Indices, Indices] = field(default_factory=lambda: (np.empty((0, 0), np.int32), np.empty(0, np.int32)))
    builds: int = 0

    def update(self, places: Sequence[Floats]) -> None:
        """Make the lists valid for x, y and z `(3, n)` [m].

        Raises:
            FloatingPointError: a position is not finite.
        """
        count, skin = len(places[0]), SKIN * self.law.length
        here = places[0], places[1], places[2]
        if count == self.built_at.shape[1] and not have_moved(here, self.built_at, skin):
            return
        self.built_at = np.array(here)
        reach = SUPPORT * self.law.length + skin
        images, source = self._images(np.stack(here, axis=1), reach)
        alone = len(images) == count  # images are numbered behind the walls
        rows, counts = list_beside(images[:count], images, reach, self.fluids if alone else len(images), self.lists[0])
        if not alone:
            rows = source[np.where(np.arange(rows.shape[1]) < counts[:, None], rows, 0)]
        if count > self.fluids:
            _all_liquid_first(rows, counts, self.fluids)
        self.lists = rows, counts
        self.builds += 1

    def of(self, i: int) -> Indices:
        """Neighbours of a particle."""
        return self.lists[0][i, : self.lists[1][i]]

    def _images(self, points: Floats, reach: float) -> tuple[Floats, Indices]:
        """Points with their images beyond the periods `(n + g, 3)`, and whose each is."""
        source = np.arange(len(points), dtype=np.int32)
        for axis, period in enumerate((self.law.period_x, self.law.period_y, self.law.period_z)):
            if not period:
                continue
            place = points[:, axis] - period * np.floor(points[:, axis] / period)
            points = points.copy()
            points[:, axis] = place
            shift = np.zeros(3)
            shift[axis] = period
            low, high = place < reach, place > period - reach
            points = np.concatenate((points, points[low] + shift, points[high] - shift))
            source = np.concatenate((source, source[low], source[high]))
        return points, source
