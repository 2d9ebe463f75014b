"""The loops over particles on a GPU: the functions of one particle that threads run, compiled for CUDA.

Particles stand in memory by the cells that they are in, the liquid's first, so that those of a warp read what is near
each other: ``state`` `(13, n)` has rows of `STATE`, ``walls`` `(5, m)` those of `Fields` that walls alone have. This
module is loaded where a case asks for a GPU, nowhere else.
"""

from functools import lru_cache
from math import floor, inf
from typing import Any, NamedTuple

from numba import config, cuda, float64, njit

from reflowshock.particles.core.neighbours import cell_of, visit
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.particle_motion import correct, cover, predict, settle, shift, speed2_of, take_slope
from reflowshock.particles.sph.particle_rates import drift_of, rates_of, wall_values
from reflowshock.particles.sph.shear_viscosity import viscosity_of

STATE = (*Fields._fields[:12], "viscosity")
THREADS_PER_BLOCK = 128
# Blocks of a loop that finds a largest value; the host takes the largest of theirs.
BLOCKS = 256
# With more, fewer threads have room on a multiprocessor: the sums over pairs ask for 177. The simulator has no limit.
LIMIT = {} if config.ENABLE_CUDASIM else {"max_registers": 128}


class Speeds(NamedTuple):
    """Rows of the state that say how fast particles are [m/s]."""

    u: Any
    v: Any
    w: Any


@njit
def fields_of(state, walls):
    """Return the rows of both as `Fields`."""
    return Fields(
        state[0], state[1], state[2], state[3], state[4], state[5], state[6], state[7], state[8], state[9], state[10],
        state[11], walls[0], walls[1], walls[2], walls[3], walls[4], state[12],
    )  # fmt: skip


def _loop(one, **options):
    """Return a loop over the first particles, of a function of one of them and of what it reads and writes."""

    @cuda.jit(**options)
    def run(count, arguments):
        i = cuda.grid(1)
        if i < count:
            one(i, arguments)

    return run


class Loops(NamedTuple):
    """The loops of a law, over what all of them get, ``state`` and ``walls``, and the arguments named here."""

    predict: Any  # rates, middle, time_step
    settle: Any  # middle
    correct: Any  # rates, middle, time_step
    take_slopes: Any  # rates
    shift: Any  # rates, factor
    find_rates: Any  # rows, counts, rates
    find_viscosities: Any  # rows, counts, rates
    find_drifts: Any  # rows, counts, middle
    cover_walls: Any  # rows, counts, rates


@lru_cache
def loops_of(law: Law) -> Loops:
    """Return the loops of a law, whose numbers are constants in them: what does not act is not compiled."""
    return Loops(*_motion_of(law), *_sums_of(law))


def _motion_of(law: Law) -> tuple[Any, ...]:
    @njit
    def predict_one(i, arguments):
        state, walls, rates, middle, time_step = arguments
        predict(i, fields_of(state, walls), rates, middle, time_step)

    @njit
    def settle_one(i, arguments):
        state, walls, middle = arguments
        settle(i, fields_of(state, walls), middle, law)

    @njit
    def correct_one(i, arguments):
        state, walls, rates, middle, time_step = arguments
        correct(i, fields_of(state, walls), rates, middle, time_step)

    @njit
    def take_one_slope(i, arguments):
        state, walls, rates = arguments
        take_slope(i, fields_of(state, walls), rates)

    @njit
    def shift_one(i, arguments):
        state, walls, rates, factor = arguments
        shift(i, fields_of(state, walls), rates, factor, law)

    return tuple(_loop(one) for one in (predict_one, settle_one, correct_one, take_one_slope, shift_one))


def _sums_of(law: Law) -> tuple[Any, ...]:
    @njit
    def find_rates(i, arguments):
        state, walls, rows, counts, rates = arguments
        found = rates_of(i, rates.shape[1], rows[: counts[i], i], fields_of(state, walls), law)
        for k in range(10):
            rates[k, i] = found[k]

    @njit
    def find_viscosity_of(i, arguments):
        state, walls, rows, counts, rates = arguments
        state[12, i] = viscosity_of(i, rates.shape[1], rows[: counts[i], i], fields_of(state, walls), law)

    @njit
    def find_drift(i, arguments):
        state, walls, rows, counts, middle = arguments
        found = drift_of(i, middle.shape[1], rows[: counts[i], i], fields_of(state, walls), law)
        for k in range(3):
            middle[4 + k, i] = found[k]

    @njit
    def cover_wall(k, arguments):
        state, walls, rows, counts, rates = arguments
        fluids, fields = rates.shape[1], fields_of(state, walls)
        i = fluids + k
        cover(k, i, fields, wall_values(i, fluids, rows[: counts[i], i], fields, law), law)

    return (_loop(find_rates, **LIMIT), *(_loop(one) for one in (find_viscosity_of, find_drift, cover_wall)))


def _largest(measure, kinds):
    """Return a loop that finds, of each block, the largest of each value that a function of one particle returns."""

    @cuda.jit
    def find(state, built_at, middle, count, found):
        block = cuda.shared.array((kinds, THREADS_PER_BLOCK), float64)
        t, i = cuda.threadIdx.x, cuda.grid(1)
        for k in range(kinds):
            block[k, t] = -inf
        while i < count:
            one = measure(i, state, built_at, middle)
            for k in range(kinds):
                block[k, t] = one[k] if one[k] > block[k, t] else block[k, t]
            i += cuda.gridsize(1)
        cuda.syncthreads()
        half = THREADS_PER_BLOCK // 2
        while half > 0:
            if t < half:
                for k in range(kinds):
                    block[k, t] = block[k, t + half] if block[k, t + half] > block[k, t] else block[k, t]
            cuda.syncthreads()
            half //= 2
        if t < kinds:
            found[t, cuda.blockIdx.x] = block[t, 0]

    return find


@njit
def _speed2(i, state, built_at, middle):
    return (speed2_of(i, Speeds(state[3], state[4], state[5])),)


@njit
def _viscosity(i, state, built_at, middle):
    return (state[12, i],)


@njit
def _span(i, state, built_at, middle):
    """Displacement since ``built_at``, its negative, and 1 where it is no number."""
    x, y, z = state[0, i] - built_at[0, i], state[1, i] - built_at[1, i], state[2, i] - built_at[2, i]
    total = x + y + z
    return x, -x, y, -y, z, -z, 0.0 if total - total == 0.0 else 1.0


@njit
def _stray(i, state, built_at, middle):
    """Square of the displacement since ``built_at`` from its ``middle``."""
    x, y, z = state[0, i] - built_at[0, i], state[1, i] - built_at[1, i], state[2, i] - built_at[2, i]
    return ((x - middle[0]) ** 2 + (y - middle[1]) ** 2 + (z - middle[2]) ** 2,)


find_fastest, find_viscosity = _largest(_speed2, 1), _largest(_viscosity, 1)
find_span, find_stray = _largest(_span, 7), _largest(_stray, 1)


@njit
def _wrap(i, arguments):
    """Put a particle within the periods [m] of a flow; 0 where it has none."""
    state, periods = arguments
    for d in range(3):
        if periods[d] > 0.0:
            state[d, i] -= periods[d] * floor(state[d, i] / periods[d])


@njit
def _find_cell(i, arguments):
    """Find the cell of the i-th particle from the first one on, and count those of each cell."""
    state, first, (origin, size, shape), cells, tally = arguments
    x, y, z = cell_of((state[0, first + i], state[1, first + i], state[2, first + i]), origin, size, shape)
    cells[i] = (x * shape[1] + y) * shape[2] + z
    cuda.atomic.add(tally, cells[i], 1)


@njit
def _add_up(p, arguments):
    """Count the particles of the p-th part of the cells."""
    tally, cells, parts, sums = arguments
    total = 0
    for c in range(p * cells // parts, (p + 1) * cells // parts):
        total += tally[c]
    sums[p] = total


@njit
def _begin_parts(i, arguments):
    """Turn the sums of all parts into the slots that they begin with, the work of one thread."""
    parts, sums = arguments
    first = 0
    for p in range(parts):
        total = sums[p]
        sums[p] = first
        first += total


@njit
def _begin_cells(p, arguments):
    """Write the slots that the cells of the p-th part begin with, and the end; nothing is counted any more."""
    tally, cells, parts, sums, start, fill = arguments
    first = sums[p]
    for c in range(p * cells // parts, (p + 1) * cells // parts):
        start[c] = fill[c] = first
        first += tally[c]
        tally[c] = 0
    if p == parts - 1:
        start[cells] = first


@njit
def _fill_cell(i, arguments):
    """Write that a particle is in its cell, in any order; ``fill`` has the next free slot of each."""
    cells, first, fill, slots = arguments
    slots[cuda.atomic.add(fill, cells[i], 1)] = first + i


@njit
def _sort_cell(c, arguments):
    """Sort the particles of a cell by their numbers: results do not depend on who came first."""
    start, slots, order = arguments
    for k in range(start[c] + 1, start[c + 1]):
        one, place = slots[k], k
        while place > start[c] and order[slots[place - 1]] > order[one]:
            slots[place] = slots[place - 1]
            place -= 1
        slots[place] = one


@njit
def _take(i, arguments):
    """Take from rows ``values`` `(k, n)` what is at the i-th of ``slots`` less the first one."""
    values, first, slots, result = arguments
    for k in range(values.shape[0]):
        result[k, i] = values[k, slots[i] - first]


@njit
def _put_back(i, arguments):
    """Put a column of ``values`` `(k, n)` to the number of its particle less the first one."""
    values, first, order, result = arguments
    for k in range(result.shape[0]):
        result[k, order[i] - first] = values[k, i]


@njit
def _add_rates(i, arguments):
    """Add accelerations and gradients of concentration `(6, n)`, by the particles' numbers, to rates."""
    given, order, rates = arguments
    for k in range(3):
        rates[1 + k, i] += given[k, order[i]]
        rates[7 + k, i] += given[3 + k, order[i]]


@njit
def _is_beside(at, radius, lattice):
    """Whether a place may have neighbours in a lattice of cells."""
    origin, size, shape = lattice
    beside = True
    for d in range(3):
        beside = beside and origin[d] - radius < at[d] < origin[d] + size * shape[d] + radius
    return beside


@njit
def _list_beside(at, radius, lattice, some, row):
    """Write who of some particles, sorted by cells, is near a place to the front of a row; return how many are."""
    start, numbers, places = some
    if row.shape[0] == 0 or not _is_beside(at, radius, lattice):
        return 0
    return visit(at, (-1, numbers[0] + numbers.shape[0]), radius, (start, numbers, places, *lattice), row)


@njit
def _list(i, arguments):
    """Write the neighbours of a particle into a column of rows `(k, n)`, the liquid first, and how many they are.

    Where the flow is periodic, who is beside an image of the particle is its neighbour, too. ``starts`` has the first
    particle of each cell of the liquid, and of walls; the largest count is put into ``most``.
    """
    (state, numbers, starts), fluids, (radius, lattice, periods), (rows, counts), most = arguments
    count = 0
    for kind in range(2 if i < fluids else 1):
        low, high = (0, fluids) if kind == 0 else (fluids, counts.shape[0])
        if low == high:
            continue
        some = starts[kind], numbers[low:high], state[:3, low:high]
        for image in range(27):
            x, y, z = image // 9 - 1, image // 3 % 3 - 1, image % 3 - 1
            if (x == 0 or periods[0] > 0.0) and (y == 0 or periods[1] > 0.0) and (z == 0 or periods[2] > 0.0):
                at = state[0, i] + x * periods[0], state[1, i] + y * periods[1], state[2, i] + z * periods[2]
                count += _list_beside(at, radius, lattice, some, rows[min(count, rows.shape[0]) :, i])
    counts[i] = count
    cuda.atomic.max(most, 0, count)


wrap, find_cells, fill_cells, sort_cells = _loop(_wrap), _loop(_find_cell), _loop(_fill_cell), _loop(_sort_cell)
add_up, begin_parts, begin_cells = _loop(_add_up), _loop(_begin_parts), _loop(_begin_cells)
take, put_back, add_rates, list_all = _loop(_take), _loop(_put_back), _loop(_add_rates), _loop(_list)


def blocks_for(count: int) -> int:
    """Return in how many blocks a loop over so many particles runs."""
    return max(1, -(-count // THREADS_PER_BLOCK))
