"""Counting sort of particles into the cells of a uniform grid on a CUDA device; see ``cells.py``.

Load this module only where a case asks for a GPU. A loop runs one thread for each particle, cell or part of the cells.
"""

from collections.abc import Callable, Sequence
from math import isqrt, prod
from typing import Any, NamedTuple

import numpy as np
from numba import cuda, njit

from reflowshock.particles.core.cells import cell_of
from reflowshock.particles.core.neighbours import SPARE

THREADS_PER_BLOCK = 128


class CellGrid(NamedTuple):
    """Uniform grid of cells.

    Attributes:
        origin: Lowest corner (x, y, z) [m].
        size: Edge length of a cell [m].
        shape: Number of cells along x, y and z.
    """

    origin: tuple[float, ...]
    size: float
    shape: tuple[int, ...]


def loop_over(function: Callable[[int, Any], None], **options: Any) -> Any:
    """Return a CUDA kernel ``(count, arguments)`` that calls ``function(i, arguments)`` for i from 0 to count - 1.

    Args:
        function: CUDA device function of an item's number i and of a tuple of arguments; it writes its results into
            arrays among these.
        options: Options of ``numba.cuda.jit``.

    Returns:
        Kernel, to be run by ``launch``; it returns nothing.
    """

    @cuda.jit(**options)
    def run(count, arguments):
        i = cuda.grid(1)
        if i < count:
            function(i, arguments)

    return run


def blocks_for(count: int) -> int:
    """Return the number of blocks of ``THREADS_PER_BLOCK`` threads for a loop over ``count`` items."""
    return max(1, -(-count // THREADS_PER_BLOCK))


def launch(kernel: Any, count: int, *arguments: Any) -> None:
    """Run a kernel of ``loop_over`` on the device; an empty loop is not launched.

    Args:
        kernel: Kernel that ``loop_over`` returned.
        count: Number of items.
        arguments: Arguments that the function of the loop gets as a tuple.
    """
    if count:
        kernel[blocks_for(count), THREADS_PER_BLOCK](count, arguments)


@njit
def raise_to(values, i, value):
    """Set ``values[i]`` to the larger of itself and ``value``, atomically, within a CUDA kernel.

    The simulator replaces ``cuda`` only in the module of ``loop_over``, so loops of other modules call this function.

    Args:
        values: Device array of numbers, shape (n,), changed in place.
        i: Index of the entry, a scalar.
        value: Scalar.
    """
    cuda.atomic.max(values, i, value)


class CellSort:
    """Counting sort of groups of particles by cells; work arrays stay on the device between calls.

    Attributes:
        permutation: Number of the stored particle that goes to each slot, shape (n,); groups stay in their ranges.
        starts: First slot of each cell and the end, counted within the group, shape (room,); one array a group.
    """

    def __init__(self, bounds: Sequence[int]) -> None:
        """Set the groups.

        Args:
            bounds: First particle of each group and the number of all particles, ascending.
        """
        self._bounds = tuple(bounds)
        count = self._bounds[-1]
        self._cell = cuda.device_array(count, np.int32)
        self.permutation = cuda.device_array(count, np.int32)
        self.starts: tuple[Any, ...] = ()
        self._counters: tuple[Any, ...] = ()

    def sort(self, positions: Any, numbers: Any, grid: CellGrid) -> None:
        """Find the permutation and the starts of all groups.

        Args:
            positions: Device array whose first three rows are x, y and z, shape (3 or more, n) [m].
            numbers: Device array of the numbers by which particles of one cell are ordered, shape (n,).
            grid: Cells; particles outside go to the nearest one.
        """
        self._reserve(prod(grid.shape))
        for group in range(len(self.starts)):
            self._sort_group(group, positions, numbers, grid)

    def _reserve(self, cells: int) -> None:
        """Make room for a number of cells; all counters are zero."""
        if not self.starts or cells >= self.starts[0].shape[0]:
            room = cells + cells // SPARE + 1
            self._counters = tuple(cuda.to_device(np.zeros(room, np.int32)) for _ in range(3))
            self.starts = tuple(cuda.to_device(np.zeros(room, np.int32)) for _ in self._bounds[1:])

    def _sort_group(self, group: int, positions: Any, numbers: Any, grid: CellGrid) -> None:
        """Sort the particles of one group."""
        first, last, starts = self._bounds[group], self._bounds[group + 1], self.starts[group]
        count, cells = last - first, prod(grid.shape)
        if not count:
            return
        parts = isqrt(cells)  # a thread adds up one part, which has as many cells as there are parts
        cell, slots, (tally, fill, sums) = self._cell[first:last], self.permutation[first:last], self._counters
        launch(_find_cells, count, positions, first, grid, cell, tally)
        launch(_sum_parts, parts, tally, cells, parts, sums)
        launch(_start_parts, 1, parts, sums)
        launch(_start_cells, parts, tally, cells, parts, sums, starts, fill)
        launch(_fill_cells, count, cell, first, fill, slots)
        launch(_order_cells, cells, starts, slots, numbers)


@njit
def _find_cell(i, arguments):
    """Write the cell of the i-th particle of a group and count the particles of each cell."""
    positions, first, (origin, size, shape), cell, tally = arguments
    point = positions[0, first + i], positions[1, first + i], positions[2, first + i]
    x, y, z = cell_of(point, origin, size, shape)
    cell[i] = (x * shape[1] + y) * shape[2] + z
    cuda.atomic.add(tally, cell[i], 1)


@njit
def _sum_part(p, arguments):
    """Count the particles in the p-th part of the cells."""
    tally, cells, parts, sums = arguments
    total = 0
    for c in range(p * cells // parts, (p + 1) * cells // parts):
        total += tally[c]
    sums[p] = total


@njit
def _start_all_parts(i, arguments):
    """Replace the counts of all parts by their first slots; the work of one thread."""
    parts, sums = arguments
    first = 0
    for p in range(parts):
        total = sums[p]
        sums[p] = first
        first += total


@njit
def _start_cells_of_part(p, arguments):
    """Write the first slots of the cells in the p-th part, and the end; reset the counts to zero."""
    tally, cells, parts, sums, starts, fill = arguments
    first = sums[p]
    for c in range(p * cells // parts, (p + 1) * cells // parts):
        starts[c] = fill[c] = first
        first += tally[c]
        tally[c] = 0
    if p == parts - 1:
        starts[cells] = first


@njit
def _fill_cell(i, arguments):
    """Write a particle into the next free slot of its cell; threads arrive in any order."""
    cell, first, fill, slots = arguments
    slots[cuda.atomic.add(fill, cell[i], 1)] = first + i


@njit
def _order_cell(c, arguments):
    """Sort the particles of a cell by their numbers, so that results do not depend on the order of threads."""
    starts, slots, numbers = arguments
    for k in range(starts[c] + 1, starts[c + 1]):
        particle, slot = slots[k], k
        while slot > starts[c] and numbers[slots[slot - 1]] > numbers[particle]:
            slots[slot] = slots[slot - 1]
            slot -= 1
        slots[slot] = particle


@njit
def _gather(i, arguments):
    """Copy one column of ``values`` (k, n): result[:, i] = values[:, slots[i] - first]."""
    values, first, slots, result = arguments
    for k in range(values.shape[0]):
        result[k, i] = values[k, slots[i] - first]


@njit
def _scatter(i, arguments):
    """Copy one column of ``values`` (k, n): result[:, numbers[i] - first] = values[:, i]."""
    values, first, numbers, result = arguments
    for k in range(result.shape[0]):
        result[k, numbers[i] - first] = values[k, i]


_find_cells, _sum_parts, _start_parts = loop_over(_find_cell), loop_over(_sum_part), loop_over(_start_all_parts)
_start_cells, _fill_cells, _order_cells = (
    loop_over(_start_cells_of_part),
    loop_over(_fill_cell),
    loop_over(_order_cell),
)
gather, scatter = loop_over(_gather), loop_over(_scatter)
