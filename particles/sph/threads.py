"""The particles of a simulation on threads: their arrays, and the loops over them.

Each loop runs a function of one particle, which `cuda_loops.py` runs on a GPU. An array that a loop writes is an
argument of its own, not only one of a tuple: Numba may drop the loop then. Within a parallel loop its index is
unsigned, but Numba looks first as if it were signed, and would compile all that is called twice: `np.uint64` says so.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import sqrt

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import have_moved, tabulate_near
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.particle_motion import correct, cover, predict, settle, shift, speed2_of, take_slope
from reflowshock.particles.sph.particle_rates import drift_of, rates_of, wall_values
from reflowshock.particles.sph.shear_viscosity import viscosity_of
from reflowshock.particles.sph.smoothing import SUPPORT

# What is found of a particle of the liquid.
RATES = 10
# Of the smoothing length: how far beyond their support particles are listed.
SKIN = 0.3
threaded = njit(cache=True, parallel=True, error_model="numpy")


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
        movers = self.fluids if alone else len(images)
        rows, counts = tabulate_near(images[:count], images, reach, movers, self.lists[0])
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


class ThreadParticles:
    """A liquid between walls, on threads.

    Attributes:
        fields: its quantities.
        rates: `(10, n)` of the liquid, as `rates_of` returns them.
        rows: neighbours.
    """

    def __init__(self, fields: Fields, fluids: int, law: Law) -> None:
        self.fields, self.rates, self.rows = fields, np.zeros((RATES, fluids)), Rows(law, fluids)
        self._law, self._fluids = law, fluids
        self._middle = np.zeros((7, fluids))
        self._near, self._near_in = np.empty(0, np.int64), self.rows.lists

    def restore(self, fields: Fields, rates: Floats, built_at: Floats, builds: int) -> None:
        """Go on from these arrays, and from neighbours found at these places `(3, n)` [m]."""
        self.fields, self.rates, self.rows = fields, rates, Rows(self._law, self._fluids)
        self.rows.update(tuple(built_at))
        self.rows.builds = builds

    @property
    def built_at(self) -> Floats:
        """Positions when neighbours were found `(3, n)` [m]."""
        return self.rows.built_at

    @property
    def builds(self) -> int:
        """How often they were found."""
        return self.rows.builds

    @property
    def neighbours(self) -> float:
        """How many a particle of the liquid has in its row, on average."""
        return float(self.rows.lists[1][: self._fluids].mean())

    @property
    def fastest(self) -> float:
        """The largest speed of the liquid [m/s]."""
        return sqrt(_fastest2(self._fluids, self.fields))

    @property
    def largest_viscosity(self) -> float:
        """Of the liquid [Pa s], where it depends on the rate of shear."""
        return float(self.fields.viscosity[: self._fluids].max())

    def predict(self, time_step: float) -> None:
        """Move the liquid over a time step [s]."""
        if self._law.xsph:
            _find_drifts(self._fluids, self.rows.lists, self.fields, self._law, self._middle)
        _predict(self.fields, self.rates, self._middle, time_step)

    @property
    def velocity(self) -> Floats:
        """What the liquid was moved with `(3, n)` [m/s], until it has settled."""
        return self._middle[:3] + self._middle[4:] if self._law.xsph else self._middle[:3]

    def settle(self) -> None:
        """Reflect what has passed through the mirror, and find pressures and neighbours."""
        _settle(self.fields, self._middle, self._law)
        self.rows.update(self.fields[:3])

    def find_rates(self) -> None:
        """Find the rates of the liquid, and before them what walls and its viscosity are."""
        fluids, lists, fields, law = self._fluids, self.rows.lists, self.fields, self._law
        _cover_walls((self._walls(), fluids), lists, fields, law, fields.wall_share)
        if law.rheology:
            _find_viscosities(fluids, lists, fields, law, fields.viscosity)
        _find_rates(fluids, lists, fields, law, self.rates)

    def _walls(self) -> NDArray[np.int64]:
        """Particles of walls to cover: all in new lists, and then those alone that have liquid in their rows."""
        if self._near_in is self.rows.lists:
            return self._near
        self._near, self._near_in = np.flatnonzero(self.rows.lists[1][self._fluids :]), self.rows.lists
        return np.arange(len(self.fields.wall_share))

    def add(self, act: Callable[[Floats, Fields], None]) -> None:
        """Let what is not a loop over particles add to the rates `(10, n)`, as the fields say."""
        act(self.rates, self.fields)

    def take_slopes(self) -> None:
        """Keep the gradients of density."""
        _take_slopes(self.fields, self.rates, self.fields.slope_x)

    def correct(self, time_step: float) -> None:
        """End a time step [s]."""
        _correct(self.fields, self.rates, self._middle, time_step)

    def shift(self, factor: float) -> None:
        """Move particles down the gradient of their concentration times a factor [m^2]."""
        _shift(self.fields, self.rates, factor, self._law)


@threaded
def _predict(fields, rates, middle, time_step):
    for k in prange(rates.shape[1]):
        predict(np.uint64(k), fields, rates, middle, time_step)


@threaded
def _settle(fields, middle, law):
    for k in prange(middle.shape[1]):
        settle(np.uint64(k), fields, middle, law)


@threaded
def _correct(fields, rates, middle, time_step):
    for k in prange(rates.shape[1]):
        correct(np.uint64(k), fields, rates, middle, time_step)


@threaded
def _take_slopes(fields, rates, slope):
    for k in prange(rates.shape[1]):
        take_slope(np.uint64(k), fields, rates)


@threaded
def _shift(fields, rates, factor, law):
    for k in prange(rates.shape[1]):
        shift(np.uint64(k), fields, rates, factor, law)


@threaded
def _fastest2(fluids, fields):
    largest = 0.0
    for k in prange(fluids):
        largest = max(largest, speed2_of(np.uint64(k), fields))
    return largest


@threaded
def _find_rates(fluids, lists, fields, law, rates):
    rows, counts = lists
    for k in prange(fluids):
        i = np.uint64(k)
        found = rates_of(i, fluids, rows[i, : counts[i]], fields, law)
        for row in range(10):
            rates[row, i] = found[row]


@threaded
def _find_viscosities(fluids, lists, fields, law, found):
    rows, counts = lists
    for k in prange(fluids):
        i = np.uint64(k)
        found[i] = viscosity_of(i, fluids, rows[i, : counts[i]], fields, law)


@threaded
def _find_drifts(fluids, lists, fields, law, middle):
    rows, counts = lists
    for k in prange(fluids):
        i = np.uint64(k)
        drift = drift_of(i, fluids, rows[i, : counts[i]], fields, law)
        for row in range(3):
            middle[4 + row, i] = drift[row]


@threaded
def _cover_walls(which, lists, fields, law, shares):
    (walls, fluids), (rows, counts) = which, lists
    for n in prange(walls.shape[0]):
        k = walls[n]
        i = fluids + k
        cover(np.uint64(k), i, fields, wall_values(i, fluids, rows[i, : counts[i]], fields, law), law)
