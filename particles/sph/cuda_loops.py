"""CUDA kernels: loops over the same functions of one particle that ``threads.py`` runs on threads.

Particles are stored by cells, liquid particles first, so that a warp reads neighbouring memory. The array ``state``,
shape (13, n), has the rows ``STATE``; ``walls``, shape (5, m), has the fields that only wall particles have. Load this
module only where a case asks for a GPU.
"""

from functools import lru_cache
from math import floor, inf
from typing import Any, NamedTuple

from numba import config, cuda, float64, njit

from reflowshock.particles.core.cells import CellList
from reflowshock.particles.core.cuda_cells import THREADS_PER_BLOCK, loop_over, raise_to
from reflowshock.particles.core.neighbours import write_near
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.particle_motion import correct, cover, predict, settle, shift, speed2_of, take_slope
from reflowshock.particles.sph.particle_rates import drift_of, rates_of, wall_values
from reflowshock.particles.sph.shear_viscosity import viscosity_of

STATE = (*Fields._fields[:12], "viscosity")
# Blocks of a reduction to the largest value; the host takes the largest of all blocks.
BLOCKS = 256
# The sums over pairs ask for 177 registers, which leaves room for too few threads on a multiprocessor. The simulator
# has no limit.
LIMIT = {} if config.ENABLE_CUDASIM else {"max_registers": 128}


class Speeds(NamedTuple):
    """Velocity rows of the state [m/s]."""

    u: Any
    v: Any
    w: Any


@njit
def fields_of(state, walls):
    """Return the rows of two device arrays as ``Fields``, without copying, within a CUDA kernel.

    Args:
        state: Values of all particles, shape (13, n): x, y, z [m], u, v, w [m/s], density [kg/m^3], pressure [Pa], mass
            [kg], density gradient (3) [kg/m^4] and viscosity [Pa s].
        walls: Values of the wall particles, shape (5, m): velocity (3) [m/s]; share of the kernel about the particle
            that liquid can fill (``Fields.wall_room``); weight of the particle (``Fields.wall_share``).
    """
    return Fields(
        state[0], state[1], state[2], state[3], state[4], state[5], state[6], state[7], state[8], state[9], state[10],
        state[11], walls[0], walls[1], walls[2], walls[3], walls[4], state[12],
    )  # fmt: skip


class Loops(NamedTuple):
    """Kernels of one law; their arguments are ``state``, ``walls`` and those named here."""

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
    """Compile the kernels of a law; its numbers are constants in them, so terms that do not act vanish.

    Args:
        law: Parameters of the pair interactions, such as kernel, smoothing length and density.

    Returns:
        Nine CUDA kernels, each a loop over particles: steps of the motion (predict, settle, correct, take_slopes,
        shift), rates, viscosities, drifts and values of walls. ``launch`` runs them; ``Loops`` lists their arguments.
    """
    return Loops(*_motion_kernels(law), *_pair_sum_kernels(law))


def _motion_kernels(law: Law) -> tuple[Any, ...]:
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

    return tuple(loop_over(step) for step in (predict_one, settle_one, correct_one, take_one_slope, shift_one))


def _pair_sum_kernels(law: Law) -> tuple[Any, ...]:
    @njit
    def find_rates(i, arguments):
        state, walls, rows, counts, rates = arguments
        sums = rates_of(i, rates.shape[1], rows[: counts[i], i], fields_of(state, walls), law)
        for k in range(10):
            rates[k, i] = sums[k]

    @njit
    def find_viscosity_of(i, arguments):
        state, walls, rows, counts, rates = arguments
        state[12, i] = viscosity_of(i, rates.shape[1], rows[: counts[i], i], fields_of(state, walls), law)

    @njit
    def find_drift(i, arguments):
        state, walls, rows, counts, middle = arguments
        drift = drift_of(i, middle.shape[1], rows[: counts[i], i], fields_of(state, walls), law)
        for k in range(3):
            middle[4 + k, i] = drift[k]

    @njit
    def cover_wall(k, arguments):
        state, walls, rows, counts, rates = arguments
        fluids, fields = rates.shape[1], fields_of(state, walls)
        i = fluids + k
        cover(k, i, fields, wall_values(i, fluids, rows[: counts[i], i], fields, law), law)

    others = (find_viscosity_of, find_drift, cover_wall)
    return (loop_over(find_rates, **LIMIT), *(loop_over(function) for function in others))


def _maximum_of(measure, kinds):
    """Return a kernel that finds, for each block, the largest of each of the values that ``measure`` returns."""

    @cuda.jit
    def find(state, built_at, middle, count, largest):
        block = cuda.shared.array((kinds, THREADS_PER_BLOCK), float64)
        t, i = cuda.threadIdx.x, cuda.grid(1)
        for k in range(kinds):
            block[k, t] = -inf
        while i < count:
            values = measure(i, state, built_at, middle)
            for k in range(kinds):
                block[k, t] = values[k] if values[k] > block[k, t] else block[k, t]
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
            largest[t, cuda.blockIdx.x] = block[t, 0]

    return find


@njit
def _speed2(i, state, built_at, middle):
    return (speed2_of(i, Speeds(state[3], state[4], state[5])),)


@njit
def _viscosity(i, state, built_at, middle):
    return (state[12, i],)


@njit
def _span(i, state, built_at, middle):
    """Return the displacement since ``built_at``, its negative, and 1 if it is not a number."""
    x, y, z = state[0, i] - built_at[0, i], state[1, i] - built_at[1, i], state[2, i] - built_at[2, i]
    total = x + y + z
    return x, -x, y, -y, z, -z, 0.0 if total - total == 0.0 else 1.0


@njit
def _stray(i, state, built_at, middle):
    """Return the squared distance of the displacement since ``built_at`` from a ``middle`` displacement [m^2]."""
    x, y, z = state[0, i] - built_at[0, i], state[1, i] - built_at[1, i], state[2, i] - built_at[2, i]
    return ((x - middle[0]) ** 2 + (y - middle[1]) ** 2 + (z - middle[2]) ** 2,)


find_fastest, find_viscosity = _maximum_of(_speed2, 1), _maximum_of(_viscosity, 1)
find_span, find_stray = _maximum_of(_span, 7), _maximum_of(_stray, 1)


@njit
def _wrap(i, arguments):
    """Move a particle into the periodic domain; a period of 0 [m] means none."""
    state, periods = arguments
    for d in range(3):
        if periods[d] > 0.0:
            state[d, i] -= periods[d] * floor(state[d, i] / periods[d])


@njit
def _add_rates(i, arguments):
    """Add accelerations and concentration gradients, shape (6, n) by the numbers of particles, to the rates."""
    added, numbers, rates = arguments
    for k in range(3):
        rates[1 + k, i] += added[k, numbers[i]]
        rates[7 + k, i] += added[3 + k, numbers[i]]


@njit
def _is_within_reach(point, radius, grid):
    """Return whether a point may have neighbours in a grid of cells."""
    origin, size, shape = grid
    is_near = True
    for d in range(3):
        is_near = is_near and origin[d] - radius < point[d] < origin[d] + size * shape[d] + radius
    return is_near


@njit
def _write_near(point, radius, grid, group, row):
    """Write the particles of a sorted group near a point to the front of a row; return how many there are."""
    starts, numbers, positions = group
    if row.shape[0] == 0 or not _is_within_reach(point, radius, grid):
        return 0
    origin, size, shape = grid
    cells = CellList(starts, numbers, positions, origin, size, shape)
    return write_near(point, (-1, numbers[0] + numbers.shape[0]), radius, cells, row)


@njit
def _list(i, arguments):
    """Write the neighbours of a particle into a column of rows (k, n), the liquid first, and their number into counts.

    In a periodic flow particles near a periodic image of the particle are neighbours, too. ``starts`` has the first
    particle of each cell, of the liquid and of walls; the largest count is written to ``most``.
    """
    (state, numbers, starts), fluids, (radius, grid, periods), (rows, counts), most = arguments
    count = 0
    for kind in range(2 if i < fluids else 1):
        low, high = (0, fluids) if kind == 0 else (fluids, counts.shape[0])
        if low == high:
            continue
        group = starts[kind], numbers[low:high], state[:3, low:high]
        for image in range(27):
            x, y, z = image // 9 - 1, image // 3 % 3 - 1, image % 3 - 1
            if (x == 0 or periods[0] > 0.0) and (y == 0 or periods[1] > 0.0) and (z == 0 or periods[2] > 0.0):
                point = state[0, i] + x * periods[0], state[1, i] + y * periods[1], state[2, i] + z * periods[2]
                count += _write_near(point, radius, grid, group, rows[min(count, rows.shape[0]) :, i])
    counts[i] = count
    raise_to(most, 0, count)


wrap, add_rates, list_neighbours = loop_over(_wrap), loop_over(_add_rates), loop_over(_list)
