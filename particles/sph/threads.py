"""Particles of a simulation on threads: arrays, neighbour lists, and the loops over particles.

Each loop calls a function of one particle, which ``cuda_loops.py`` runs on a GPU. An array that a loop writes is a
separate argument: if it were only in a tuple, Numba could drop the loop. The index of a parallel loop is unsigned, but
Numba first compiles with a signed one; ``np.uint64`` avoids that every called function is compiled twice.
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

# Number of rates of a liquid particle.
RATES = 10
# Skin of the neighbour lists, in smoothing lengths.
SKIN = 0.3
threaded = njit(cache=True, parallel=True, error_model="numpy")


@njit(cache=True)
def liquid_first(row, fluids):
    """Reorder a row of neighbours in place so that liquid particles come first.

    Args:
        row: Numbers of the neighbours, shape (k,).
        fluids: Number of liquid particles, integer; particles with smaller numbers are liquid.
    """
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
    """Neighbour table of all particles, liquid neighbours first, rebuilt when particles have moved by the skin.

    Attributes:
        law: Parameters of the pair interactions, with support and periods.
        fluids: Number of liquid particles; wall particles list only these.
        built_at: Positions for which the table was built, shape (3, n) [m].
        lists: Table of neighbours (n, k) and the number of valid entries of each row (n,); a liquid particle is in its
            own
            row.
        builds: Number of times the table was built.
    """

    law: Law
    fluids: int
    built_at: Floats = field(default_factory=lambda: np.empty((3, 0)))
    lists: tuple[Indices, Indices] = field(default_factory=lambda: (np.empty((0, 0), np.int32), np.empty(0, np.int32)))
    builds: int = 0

    def update(self, positions: Sequence[Floats]) -> None:
        """Rebuild the table if it may lack pairs at these positions.

        Args:
            positions: Rows x, y and z, shape (3, n) [m].

        Raises:
            FloatingPointError: A position is not finite.
        """
        count, skin = len(positions[0]), SKIN * self.law.length
        rows_xyz = positions[0], positions[1], positions[2]
        if count == self.built_at.shape[1] and not have_moved(rows_xyz, self.built_at, skin):
            return
        self.built_at = np.array(rows_xyz)
        reach = SUPPORT * self.law.length + skin
        images, source = self._images(np.stack(rows_xyz, axis=1), reach)
        has_no_images = len(images) == count  # images are numbered after the walls
        movers = self.fluids if has_no_images else len(images)
        rows, counts = tabulate_near(images[:count], images, reach, movers, self.lists[0])
        if not has_no_images:
            rows = source[np.where(np.arange(rows.shape[1]) < counts[:, None], rows, 0)]
        if count > self.fluids:
            _all_liquid_first(rows, counts, self.fluids)
        self.lists = rows, counts
        self.builds += 1

    def of(self, i: int) -> Indices:
        """Return the neighbours of a particle."""
        return self.lists[0][i, : self.lists[1][i]]

    def _images(self, points: Floats, reach: float) -> tuple[Floats, Indices]:
        """Return points with their periodic images within reach, shape (n + g, 3), and the particle of each."""
        source = np.arange(len(points), dtype=np.int32)
        for axis, period in enumerate((self.law.period_x, self.law.period_y, self.law.period_z)):
            if not period:
                continue
            coordinate = points[:, axis] - period * np.floor(points[:, axis] / period)
            points = points.copy()
            points[:, axis] = coordinate
            shift = np.zeros(3)
            shift[axis] = period
            low, high = coordinate < reach, coordinate > period - reach
            points = np.concatenate((points, points[low] + shift, points[high] - shift))
            source = np.concatenate((source, source[low], source[high]))
        return points, source


class ThreadParticles:
    """Liquid and walls on threads.

    Attributes:
        fields: Fields of all particles.
        rates: Rates of the liquid, as ``rates_of`` returns them, shape (10, n).
        rows: Neighbour table.
    """

    def __init__(self, fields: Fields, fluids: int, law: Law) -> None:
        self.fields, self.rates, self.rows = fields, np.zeros((RATES, fluids)), Rows(law, fluids)
        self._law, self._fluids = law, fluids
        self._middle = np.zeros((7, fluids))
        self._near, self._near_in = np.empty(0, np.int64), self.rows.lists

    def restore(self, fields: Fields, rates: Floats, built_at: Floats, builds: int) -> None:
        """Continue from saved fields and rates, with the neighbours of earlier positions (3, n) [m]."""
        self.fields, self.rates, self.rows = fields, rates, Rows(self._law, self._fluids)
        self.rows.update(tuple(built_at))
        self.rows.builds = builds

    @property
    def built_at(self) -> Floats:
        """Positions for which neighbours were listed, shape (3, n) [m]."""
        return self.rows.built_at

    @property
    def builds(self) -> int:
        """Number of times neighbours were listed."""
        return self.rows.builds

    @property
    def neighbours(self) -> float:
        """Mean number of listed neighbours of a liquid particle."""
        return float(self.rows.lists[1][: self._fluids].mean())

    @property
    def fastest(self) -> float:
        """Largest speed of the liquid [m/s]."""
        return sqrt(_fastest2(self._fluids, self.fields))

    @property
    def largest_viscosity(self) -> float:
        """Largest viscosity of the liquid [Pa s], where it depends on the shear rate."""
        return float(self.fields.viscosity[: self._fluids].max())

    def predict(self, time_step: float) -> None:
        """Move the liquid over a time step [s]."""
        if self._law.xsph:
            _find_drifts(self._fluids, self.rows.lists, self.fields, self._law, self._middle)
        _predict(self.fields, self.rates, self._middle, time_step)

    @property
    def velocity(self) -> Floats:
        """Velocities by which ``predict`` moved the liquid, shape (3, n) [m/s]; valid until ``settle``."""
        return self._middle[:3] + self._middle[4:] if self._law.xsph else self._middle[:3]

    def settle(self) -> None:
        """Reflect particles that crossed the mirror; update pressures and neighbours."""
        _settle(self.fields, self._middle, self._law)
        self.rows.update(self.fields[:3])

    def find_rates(self) -> None:
        """Compute the rates of the liquid, and before them the values of walls and the viscosity."""
        fluids, lists, fields, law = self._fluids, self.rows.lists, self.fields, self._law
        _cover_walls((self._walls(), fluids), lists, fields, law, fields.wall_share)
        if law.rheology:
            _find_viscosities(fluids, lists, fields, law, fields.viscosity)
        _find_rates(fluids, lists, fields, law, self.rates)

    def _walls(self) -> NDArray[np.int64]:
        """Return the wall particles to update: all of a new table, later only those with liquid neighbours."""
        if self._near_in is self.rows.lists:
            return self._near
        self._near, self._near_in = np.flatnonzero(self.rows.lists[1][self._fluids :]), self.rows.lists
        return np.arange(len(self.fields.wall_share))

    def add(self, act: Callable[[Floats, Fields], None]) -> None:
        """Let a function of rates (10, n) and fields add to the rates."""
        act(self.rates, self.fields)

    def take_slopes(self) -> None:
        """Store the density gradients for the next step."""
        _take_slopes(self.fields, self.rates, self.fields.slope_x)

    def correct(self, time_step: float) -> None:
        """Complete a time step [s] with the rates at its end."""
        _correct(self.fields, self.rates, self._middle, time_step)

    def shift(self, factor: float) -> None:
        """Shift particles against the concentration gradient times a factor [m^2]."""
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
