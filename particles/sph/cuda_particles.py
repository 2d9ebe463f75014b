"""The particles of a simulation on a GPU, where their arrays stay; the host sees fields only when it asks for them.

There they stand by cells of the liquid, sorted again with every list of neighbours; to the host they keep their
numbers. A step needs two numbers of the device: the largest speed, and how far particles have moved.
"""

from collections.abc import Callable
from math import isqrt, sqrt
from typing import Any

import numpy as np
from numba import cuda

from reflowshock.arrays import Floats
from reflowshock.particles.core.neighbours import FEWEST, REACH, SPARE
from reflowshock.particles.sph import cuda_loops as loops
from reflowshock.particles.sph.cuda_loops import BLOCKS, STATE, THREADS_PER_BLOCK, blocks_for
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.smoothing import SUPPORT
from reflowshock.particles.sph.threads import RATES, SKIN

WALLS = Fields._fields[12:17]
MOVING = STATE.index("density") + 1  # the first rows of a state: positions, velocities, densities
Vector = tuple[float, float, float]
Lattice = tuple[Vector, float, tuple[int, int, int]]
NOWHERE = (0.0, 0.0, 0.0)


class NoDeviceError(RuntimeError):
    """There is no GPU that CUDA can use."""


class CudaParticles:
    """`threads.ThreadParticles` on a GPU, equal to them to rounding; those of a periodic flow are put within it.

    Raises:
        NoDeviceError: there is none.
    """

    def __init__(self, fields: Fields, fluids: int, law: Law) -> None:
        if not cuda.is_available():
            raise NoDeviceError("no CUDA device; numerics.device = cpu runs on threads")
        self._law, self._fluids, self._count = law, fluids, len(fields.x)
        self._loops, self._periods = loops.loops_of(law), (law.period_x, law.period_y, law.period_z)
        self._given = fields  # masses do not change
        self._numbers = cuda.to_device(np.arange(self._count, dtype=np.int32))
        self._nowhere = _zeros(3, self._count)
        self._rows = cuda.device_array((FEWEST, self._count), np.int32)
        self._counts = cuda.to_device(np.zeros(self._count, np.int32))
        self._cells, self._slots = (cuda.device_array(self._count, np.int32) for _ in range(2))
        self._built_at = _zeros(3, self._count)
        self._counters: Any = None
        self._starts: Any = None
        self._rates, self._middle = _zeros(RATES, fluids), _zeros(7, fluids)
        self.builds = 0
        self._start(fields)

    def _start(self, fields: Fields) -> None:
        """Take fields to the device, where particles stand by their numbers until neighbours are sought."""
        self._state = cuda.to_device(np.array([getattr(fields, name) for name in STATE]))
        self._walls = cuda.to_device(np.array([getattr(fields, name) for name in WALLS]))
        self._order = cuda.to_device(np.arange(self._count, dtype=np.int32))
        old = self._state, self._walls, self._middle, self._order
        self._spare = tuple(cuda.device_array_like(one) for one in old)
        self._host: Fields | None = fields
        self._fastest: float | None = None
        self._listed = False

    def restore(self, fields: Fields, rates: Floats, built_at: Floats, builds: int) -> None:
        """Go on from these arrays, and from neighbours found at these places `(3, n)` [m]."""
        self._start(fields._replace(x=built_at[0], y=built_at[1], z=built_at[2]))
        self._find_neighbours()
        self.builds, self._given = builds, fields
        state = cuda.to_device(np.array([getattr(fields, name) for name in STATE]))
        self._loop(loops.take, self._count, state, 0, self._order, self._state)
        self._loop(loops.take, self._fluids, cuda.to_device(rates), 0, self._order[: self._fluids], self._rates)
        self._host = None

    @property
    def fields(self) -> Fields:
        """Copies of the fields, on the host."""
        if self._host is None:
            found = dict(zip(STATE, self._on_host(self._state), strict=True))
            walls = dict(zip(WALLS, self._on_host(self._walls, self._fluids), strict=True))
            self._host = Fields(**found, **walls)
        return self._host

    @property
    def rates(self) -> Floats:
        """Copies of the rates `(10, n)`, on the host."""
        return self._on_host(self._rates)

    @property
    def built_at(self) -> Floats:
        """Positions when neighbours were found `(3, n)` [m]."""
        return self._on_host(self._built_at)

    @property
    def neighbours(self) -> float:
        """How many a particle of the liquid has in its row, on average."""
        return float(self._counts[: self._fluids].copy_to_host().mean())

    @property
    def velocity(self) -> Floats:
        """What the liquid was moved with `(3, n)` [m/s], until it has settled."""
        if not self._law.xsph:
            return self._on_host(self._middle[:3])
        found = self._on_host(self._middle)
        return np.ascontiguousarray(found[:3] + found[4:])

    @property
    def fastest(self) -> float:
        """The largest speed of the liquid [m/s]."""
        if self._fastest is None:
            self._fastest = sqrt(self._largest(loops.find_fastest, self._fluids, 1)[0])
        return self._fastest

    @property
    def largest_viscosity(self) -> float:
        """Of the liquid [Pa s], where it depends on the rate of shear."""
        return float(self._largest(loops.find_viscosity, self._fluids, 1)[0])

    def predict(self, time_step: float) -> None:
        """Move the liquid over a time step [s]."""
        if self._law.xsph:
            self._run(self._loops.find_drifts, self._rows, self._counts, self._middle)
        self._run(self._loops.predict, self._rates, self._middle, time_step)

    def settle(self) -> None:
        """Reflect what has passed through the mirror, and find pressures and neighbours."""
        self._run(self._loops.settle, self._middle)
        if not self._listed or self._have_moved():
            self._find_neighbours()

    def find_rates(self) -> None:
        """Find the rates of the liquid, and before them what walls and its viscosity are."""
        lists = self._rows, self._counts, self._rates
        self._run(self._loops.cover_walls, *lists, count=self._count - self._fluids)
        if self._law.rheology:
            self._run(self._loops.find_viscosities, *lists)
        self._run(self._loops.find_rates, *lists)

    def add(self, act: Callable[[Floats, Fields], None]) -> None:
        """Let the host add to rates 1 to 3 and 7 to 9; it has present positions, velocities, densities, viscosities."""
        found = np.zeros((RATES, self._fluids))
        now = dict(zip(STATE[:MOVING], self._on_host(self._state[:MOVING]), strict=True))
        if self._law.rheology:
            now["viscosity"] = self._on_host(self._state[-1:])[0]
        act(found, self._given._replace(**now))
        given = cuda.to_device(np.concatenate((found[1:4], found[7:10])))
        self._loop(loops.add_rates, self._fluids, given, self._order, self._rates)

    def take_slopes(self) -> None:
        """Keep the gradients of density."""
        self._run(self._loops.take_slopes, self._rates)

    def correct(self, time_step: float) -> None:
        """End a time step [s]."""
        self._run(self._loops.correct, self._rates, self._middle, time_step)
        self._fastest = None

    def shift(self, factor: float) -> None:
        """Move particles down the gradient of their concentration times a factor [m^2]."""
        self._run(self._loops.shift, self._rates, factor)

    def _run(self, kernel: Any, *rest: Any, count: int | None = None) -> None:
        """Run a loop of the law over the liquid, or so many particles."""
        self._loop(kernel, self._fluids if count is None else count, self._state, self._walls, *rest)
        self._host = None

    def _loop(self, kernel: Any, count: int, *arguments: Any) -> None:
        if count:
            kernel[blocks_for(count), THREADS_PER_BLOCK](count, arguments)

    def _largest(self, kernel: Any, count: int, kinds: int, since: Any = None, middle: Vector = NOWHERE) -> Floats:
        """Return the largest of some values `(kinds,)` of the first particles."""
        blocks = min(BLOCKS, blocks_for(count))
        found = cuda.device_array((kinds, blocks))
        since = self._nowhere if since is None else since
        kernel[blocks, THREADS_PER_BLOCK](self._state, since, middle, count, found)
        return np.asarray(found.copy_to_host()).max(axis=1)

    def _on_host(self, values: Any, first: int = 0) -> Floats:
        """Return values of particles from the first one on `(k, n)`, in the order of their numbers."""
        result = cuda.device_array(values.shape)
        self._loop(loops.put_back, values.shape[1], values, first, self._order[first:], result)
        return np.asarray(result.copy_to_host())

    def _have_moved(self) -> bool:
        """Whether lists may lack pairs; see `core.neighbours.have_moved`."""
        span = self._largest(loops.find_span, self._count, 7, self._built_at)
        high, low, limit = span[:6:2], -span[1:6:2], (0.5 * SKIN * self._law.length) ** 2
        if not span[6] and 0.25 * ((high - low) ** 2).sum() <= limit:  # none is farther from the middle than corners
            return False
        x, y, z = (0.5 * (low + high)).tolist()
        return bool(span[6] or self._largest(loops.find_stray, self._count, 1, self._built_at, (x, y, z))[0] > limit)

    def _find_neighbours(self) -> None:
        """Sort particles by cells and list their neighbours.

        Raises:
            FloatingPointError: a position is not finite.
        """
        self._loop(loops.wrap, self._count, self._state, self._periods)
        span = self._largest(loops.find_span, self._count, 7)
        if span[6]:
            raise FloatingPointError("find_neighbours: a particle position is not finite")
        low, reach = -span[1:6:2], (SUPPORT + SKIN) * self._law.length
        shape = (((span[:6:2] - low) * REACH / reach).astype(int) + 1).tolist()
        lattice = tuple(low.tolist()), reach / REACH, tuple(shape)
        self._make_room(int(np.prod(shape)))
        self._sort(0, self._fluids, lattice, self._starts[0])
        self._sort(self._fluids, self._count, lattice, self._starts[1])
        self._stand_sorted()
        most = self._list(reach, lattice)
        while most >= self._rows.shape[0]:  # the last place of a row is there for what does not fit
            self._rows = cuda.device_array((most + most // SPARE + 1, self._count), np.int32)
            most = self._list(reach, lattice)
        self._built_at.copy_to_device(self._state[:3])
        self._listed = True
        self.builds += 1

    def _list(self, reach: float, lattice: Lattice) -> int:
        """Write the rows of all particles; return the largest number of neighbours."""
        largest = cuda.to_device(np.zeros(1, np.int32))
        sorted_, within = (self._state, self._numbers, self._starts), (reach, lattice, self._periods)
        self._loop(loops.list_all, self._count, sorted_, self._fluids, within, (self._rows, self._counts), largest)
        return int(largest.copy_to_host()[0])

    def _sort(self, first: int, last: int, lattice: Lattice, start: Any) -> None:
        """Find who is in each cell, of the particles from the first to the last; write the first slot of each."""
        count, cells = last - first, int(np.prod(lattice[2]))
        if not count:
            return
        parts = isqrt(cells)  # in each of which a thread goes through as many cells
        where, slots, (tally, fill, sums) = self._cells[first:last], self._slots[first:last], self._counters
        self._loop(loops.find_cells, count, self._state, first, lattice, where, tally)
        self._loop(loops.add_up, parts, tally, cells, parts, sums)
        self._loop(loops.begin_parts, 1, parts, sums)
        self._loop(loops.begin_cells, parts, tally, cells, parts, sums, start, fill)
        self._loop(loops.fill_cells, count, where, first, fill, slots)
        self._loop(loops.sort_cells, cells, start, slots, self._order)

    def _make_room(self, cells: int) -> None:
        """Have counters for so many cells, none of which has counted anything."""
        if self._starts is None or cells >= self._starts[0].shape[0]:
            room = cells + cells // SPARE + 1
            self._counters = tuple(cuda.to_device(np.zeros(room, np.int32)) for _ in range(3))
            self._starts = tuple(cuda.to_device(np.zeros(room, np.int32)) for _ in range(2))

    def _stand_sorted(self) -> None:
        """Let particles stand as they were sorted."""
        count, fluids, slots = self._count, self._fluids, self._slots
        old = self._state, self._walls, self._middle, self._order
        state, walls, middle, order = self._spare
        self._loop(loops.take, count, self._state, 0, slots, state)
        self._loop(loops.take, count - fluids, self._walls, fluids, slots[fluids:], walls)
        self._loop(loops.take, fluids, self._middle, 0, slots[:fluids], middle)
        self._loop(loops.take, count, self._order.reshape(1, count), 0, slots, order.reshape(1, count))
        (self._state, self._walls, self._middle, self._order), self._spare = self._spare, old


def _zeros(*shape: int) -> Any:
    return cuda.to_device(np.zeros(shape))
