"""Particles of a simulation on a GPU: their arrays stay on the device, and the host copies fields only on request.

Particles are stored by cells and sorted again whenever neighbours are listed; on the host they keep their numbers.
A step transfers two results to the host: the largest speed, and how far particles have moved.
"""

from collections.abc import Callable
from math import sqrt
from typing import Any

import numpy as np
from numba import cuda

from reflowshock.arrays import Floats
from reflowshock.particles.core.cuda_cells import (
    THREADS_PER_BLOCK,
    CellGrid,
    CellSort,
    blocks_for,
    gather,
    launch,
    scatter,
)
from reflowshock.particles.core.neighbours import CELLS_PER_RADIUS, SHORTEST_ROW, SPARE
from reflowshock.particles.sph import cuda_loops as loops
from reflowshock.particles.sph.cuda_loops import BLOCKS, STATE
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.smoothing import SUPPORT
from reflowshock.particles.sph.threads import RATES, SKIN

WALLS = Fields._fields[12:17]
# The first rows of a state: positions, velocities and densities, which change in every step.
MOVING = STATE.index("density") + 1
Vector = tuple[float, float, float]
NOWHERE = (0.0, 0.0, 0.0)


class NoDeviceError(RuntimeError):
    """No GPU that CUDA can use."""


class CudaParticles:
    """Liquid and walls on a GPU, with the interface of ``ThreadParticles`` and equal results up to rounding.

    Particles of a periodic flow are moved into its domain.

    Raises:
        NoDeviceError: The machine has no CUDA device.
    """

    def __init__(self, fields: Fields, fluids: int, law: Law) -> None:
        if not cuda.is_available():
            raise NoDeviceError("no CUDA device; numerics.device = cpu runs on threads")
        self._law, self._fluids, self._count = law, fluids, len(fields.x)
        self._loops, self._periods = loops.loops_of(law), (law.period_x, law.period_y, law.period_z)
        self._initial = fields  # masses do not change
        self._indices = cuda.to_device(np.arange(self._count, dtype=np.int32))
        self._nowhere = _zeros(3, self._count)
        self._rows = cuda.device_array((SHORTEST_ROW, self._count), np.int32)
        self._counts = cuda.to_device(np.zeros(self._count, np.int32))
        self._cell_sort = CellSort((0, fluids, self._count))
        self._built_at = _zeros(3, self._count)
        self._rates, self._middle = _zeros(RATES, fluids), _zeros(7, fluids)
        self.builds = 0
        self._start(fields)

    def _start(self, fields: Fields) -> None:
        """Copy fields to the device, where particles are stored by their numbers until neighbours are listed."""
        self._state = cuda.to_device(np.array([getattr(fields, name) for name in STATE]))
        self._walls = cuda.to_device(np.array([getattr(fields, name) for name in WALLS]))
        self._numbers = cuda.to_device(np.arange(self._count, dtype=np.int32))
        arrays = self._state, self._walls, self._middle, self._numbers
        self._spare = tuple(cuda.device_array_like(array) for array in arrays)
        self._host: Fields | None = fields
        self._fastest: float | None = None
        self._is_listed = False

    def restore(self, fields: Fields, rates: Floats, built_at: Floats, builds: int) -> None:
        """Continue from these arrays, with the neighbours of earlier positions.

        Args:
            fields: Fields of all particles.
            rates: Rates of the liquid, shape (10, n).
            built_at: Positions for which neighbours were listed, shape (3, n) [m].
            builds: Number of times neighbours were listed.
        """
        self._start(fields._replace(x=built_at[0], y=built_at[1], z=built_at[2]))
        self._list_neighbours()
        self.builds, self._initial = builds, fields
        state = cuda.to_device(np.array([getattr(fields, name) for name in STATE]))
        launch(gather, self._count, state, 0, self._numbers, self._state)
        launch(gather, self._fluids, cuda.to_device(rates), 0, self._numbers[: self._fluids], self._rates)
        self._host = None

    @property
    def fields(self) -> Fields:
        """Fields of all particles, copied to the host."""
        if self._host is None:
            moving = dict(zip(STATE, self._on_host(self._state), strict=True))
            walls = dict(zip(WALLS, self._on_host(self._walls, self._fluids), strict=True))
            self._host = Fields(**moving, **walls)
        return self._host

    @property
    def rates(self) -> Floats:
        """Rates of the liquid, shape (10, n), copied to the host."""
        return self._on_host(self._rates)

    @property
    def built_at(self) -> Floats:
        """Positions for which neighbours were listed, shape (3, n) [m], copied to the host."""
        return self._on_host(self._built_at)

    @property
    def neighbours(self) -> float:
        """Mean number of neighbours of a liquid particle."""
        return float(self._counts[: self._fluids].copy_to_host().mean())

    @property
    def velocity(self) -> Floats:
        """Velocities by which ``predict`` moved the liquid, shape (3, n) [m/s]; valid until ``settle``."""
        if not self._law.xsph:
            return self._on_host(self._middle[:3])
        middle = self._on_host(self._middle)
        return np.ascontiguousarray(middle[:3] + middle[4:])

    @property
    def fastest(self) -> float:
        """Largest speed of the liquid [m/s]."""
        if self._fastest is None:
            self._fastest = sqrt(self._largest(loops.find_fastest, self._fluids, 1)[0])
        return self._fastest

    @property
    def largest_viscosity(self) -> float:
        """Largest viscosity of the liquid [Pa s], where it depends on the shear rate."""
        return float(self._largest(loops.find_viscosity, self._fluids, 1)[0])

    def predict(self, time_step: float) -> None:
        """Move the liquid over a time step [s]."""
        if self._law.xsph:
            self._run(self._loops.find_drifts, self._rows, self._counts, self._middle)
        self._run(self._loops.predict, self._rates, self._middle, time_step)

    def settle(self) -> None:
        """Reflect particles that crossed the mirror; update pressures and neighbours."""
        self._run(self._loops.settle, self._middle)
        if not self._is_listed or self._have_moved():
            self._list_neighbours()

    def find_rates(self) -> None:
        """Compute the rates of the liquid, and before them the values of walls and the viscosity."""
        lists = self._rows, self._counts, self._rates
        self._run(self._loops.cover_walls, *lists, count=self._count - self._fluids)
        if self._law.rheology:
            self._run(self._loops.find_viscosities, *lists)
        self._run(self._loops.find_rates, *lists)

    def add(self, act: Callable[[Floats, Fields], None]) -> None:
        """Let a function on the host add to rows 1 to 3 and 7 to 9 of the rates.

        Args:
            act: Called with rates of zero, shape (10, n), and fields of which positions, velocities, densities and
                viscosities are present values.
        """
        added = np.zeros((RATES, self._fluids))
        present = dict(zip(STATE[:MOVING], self._on_host(self._state[:MOVING]), strict=True))
        if self._law.rheology:
            present["viscosity"] = self._on_host(self._state[-1:])[0]
        act(added, self._initial._replace(**present))
        on_device = cuda.to_device(np.concatenate((added[1:4], added[7:10])))
        launch(loops.add_rates, self._fluids, on_device, self._numbers, self._rates)

    def take_slopes(self) -> None:
        """Store the density gradients of the rates for the next step."""
        self._run(self._loops.take_slopes, self._rates)

    def correct(self, time_step: float) -> None:
        """Complete a time step [s] with the rates at its end."""
        self._run(self._loops.correct, self._rates, self._middle, time_step)
        self._fastest = None

    def shift(self, factor: float) -> None:
        """Shift particles against the concentration gradient times a factor [m^2]."""
        self._run(self._loops.shift, self._rates, factor)

    def _run(self, kernel: Any, *rest: Any, count: int | None = None) -> None:
        """Run a kernel of the law over the liquid, or over ``count`` particles."""
        launch(kernel, self._fluids if count is None else count, self._state, self._walls, *rest)
        self._host = None

    def _largest(self, kernel: Any, count: int, kinds: int, since: Any = None, middle: Vector = NOWHERE) -> Floats:
        """Return the largest of each kind of value over the first ``count`` particles, shape (kinds,)."""
        blocks = min(BLOCKS, blocks_for(count))
        of_blocks = cuda.device_array((kinds, blocks))
        since = self._nowhere if since is None else since
        kernel[blocks, THREADS_PER_BLOCK](self._state, since, middle, count, of_blocks)
        return np.asarray(of_blocks.copy_to_host()).max(axis=1)

    def _on_host(self, values: Any, first: int = 0) -> Floats:
        """Copy values, shape (k, n), of the particles from the first one on to the host, ordered by their numbers."""
        result = cuda.device_array(values.shape)
        launch(scatter, values.shape[1], values, first, self._numbers[first:], result)
        return np.asarray(result.copy_to_host())

    def _have_moved(self) -> bool:
        """Return whether lists may lack pairs; see ``core.neighbours.have_moved``."""
        span = self._largest(loops.find_span, self._count, 7, self._built_at)
        high, low, limit = span[:6:2], -span[1:6:2], (0.5 * SKIN * self._law.length) ** 2
        if not span[6] and 0.25 * ((high - low) ** 2).sum() <= limit:  # no displacement is outside this box
            return False
        x, y, z = (0.5 * (low + high)).tolist()
        return bool(span[6] or self._largest(loops.find_stray, self._count, 1, self._built_at, (x, y, z))[0] > limit)

    def _list_neighbours(self) -> None:
        """Sort particles by cells and list their neighbours.

        Raises:
            FloatingPointError: A position is not finite.
        """
        launch(loops.wrap, self._count, self._state, self._periods)
        span = self._largest(loops.find_span, self._count, 7)
        if span[6]:
            raise FloatingPointError("find_neighbours: a particle position is not finite")
        low, reach = -span[1:6:2], (SUPPORT + SKIN) * self._law.length
        shape = ((span[:6:2] - low) * CELLS_PER_RADIUS / reach).astype(int) + 1
        grid = CellGrid(tuple(low.tolist()), reach / CELLS_PER_RADIUS, tuple(shape.tolist()))
        self._cell_sort.sort(self._state, self._numbers, grid)
        self._reorder(self._cell_sort.permutation)
        most = self._fill_rows(reach, grid)
        while most >= self._rows.shape[0]:  # the last entry of a row takes what does not fit
            self._rows = cuda.device_array((most + most // SPARE + 1, self._count), np.int32)
            most = self._fill_rows(reach, grid)
        self._built_at.copy_to_device(self._state[:3])
        self._is_listed = True
        self.builds += 1

    def _fill_rows(self, reach: float, grid: CellGrid) -> int:
        """Write the rows of all particles; return the largest number of neighbours."""
        largest = cuda.to_device(np.zeros(1, np.int32))
        stored, search = (self._state, self._indices, self._cell_sort.starts), (reach, grid, self._periods)
        rows = self._rows, self._counts
        launch(loops.list_neighbours, self._count, stored, self._fluids, search, rows, largest)
        return int(largest.copy_to_host()[0])

    def _reorder(self, permutation: Any) -> None:
        """Store particles in the order of a permutation, the liquid's and the walls' each within their range."""
        count, fluids = self._count, self._fluids
        old = self._state, self._walls, self._middle, self._numbers
        state, walls, middle, numbers = self._spare
        launch(gather, count, self._state, 0, permutation, state)
        launch(gather, count - fluids, self._walls, fluids, permutation[fluids:], walls)
        launch(gather, fluids, self._middle, 0, permutation[:fluids], middle)
        launch(gather, count, self._numbers.reshape(1, count), 0, permutation, numbers.reshape(1, count))
        (self._state, self._walls, self._middle, self._numbers), self._spare = self._spare, old


def _zeros(*shape: int) -> Any:
    return cuda.to_device(np.zeros(shape))
