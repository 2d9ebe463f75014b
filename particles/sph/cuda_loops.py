"""The loops over particles on a GPU: the functions of one particle that threads run, compiled for CUDA.

Fields go to the device and rates come back with every call, some 180 bytes a particle; lists of neighbours go there
when they are made. All else stays with the processor. This module is loaded where a case asks for a GPU, nowhere else.
"""

from typing import Any

import numpy as np
from numba import cuda

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.particle_rates import drift_of, rates_of, wall_values
from reflowshock.particles.sph.shear_viscosity import viscosity_of

THREADS_PER_BLOCK = 128


class NoDeviceError(RuntimeError):
    """There is no GPU that CUDA can use."""


@cuda.jit
def _find_rates(fluids, lists, fields, law, rates):
    offsets, indices = lists
    i = cuda.grid(1)
    if i < fluids:
        found = rates_of(i, fluids, indices[offsets[i] : offsets[i + 1]], fields, law)
        for k in range(rates.shape[0]):
            rates[k, i] = found[k]


@cuda.jit
def _find_viscosities(fluids, lists, fields, law, found):
    offsets, indices = lists
    i = cuda.grid(1)
    if i < fluids:
        found[0, i] = viscosity_of(i, fluids, indices[offsets[i] : offsets[i + 1]], fields, law)


@cuda.jit
def _find_drifts(fluids, lists, fields, law, found):
    offsets, indices = lists
    i = cuda.grid(1)
    if i < fluids:
        drift = drift_of(i, fluids, indices[offsets[i] : offsets[i + 1]], fields, law)
        for k in range(found.shape[0]):
            found[k, i] = drift[k]


@cuda.jit
def _find_wall_values(fluids, lists, fields, law, found):
    offsets, indices = lists
    i = fluids + cuda.grid(1)
    if i < fields.x.shape[0]:
        values = wall_values(i, fluids, indices[offsets[i] : offsets[i + 1]], fields, law)
        for k in range(found.shape[0]):
            found[k, i - fluids] = values[k]


class CudaLoops:
    """`threads.ThreadLoops` on a GPU, equal to them to rounding.

    Raises:
        NoDeviceError: there is none.
    """

    def __init__(self, law: Law) -> None:
        if not cuda.is_available():
            raise NoDeviceError("no CUDA device; numerics.device = cpu runs on threads")
        self._law = law
        self._lists: tuple[Indices, Indices] | None = None  # of the host, those that are on the device
        self._there: tuple[Any, Any] = (None, None)

    def find_rates(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, rates: Floats) -> None:
        """Write what `rates_of` returns of each particle of the liquid into rows of ``rates`` `(10, n)`."""
        self._run(_find_rates[_blocks(fluids), THREADS_PER_BLOCK], (fluids, self._on_device(lists)), fields, rates)

    def find_wall_values(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, found: Floats) -> None:
        """Write what `wall_values` returns of each particle of walls into rows of ``found`` `(5, m)`."""
        if found.size:
            kernel = _find_wall_values[_blocks(found.shape[1]), THREADS_PER_BLOCK]
            self._run(kernel, (fluids, self._on_device(lists)), fields, found)

    def find_viscosities(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, found: Floats) -> None:
        """Write the viscosity of each particle of the liquid into the row of ``found`` `(1, n)`."""
        kernel = _find_viscosities[_blocks(fluids), THREADS_PER_BLOCK]
        self._run(kernel, (fluids, self._on_device(lists)), fields, found)

    def find_drifts(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, found: Floats) -> None:
        """Write what `drift_of` returns of each particle of the liquid into rows of ``found`` `(3, n)`."""
        kernel = _find_drifts[_blocks(fluids), THREADS_PER_BLOCK]
        self._run(kernel, (fluids, self._on_device(lists)), fields, found)

    def _run(self, kernel: Any, particles: tuple[int, tuple[Any, Any]], fields: Fields, result: Floats) -> None:
        """Run a configured kernel of which particles and neighbours; its rows come back into ``result``."""
        there = cuda.device_array(result.shape, np.float64)
        kernel(*particles, Fields(*(cuda.to_device(one) for one in fields)), self._law, there)
        there.copy_to_host(result)

    def _on_device(self, lists: tuple[Indices, Indices]) -> tuple[Any, Any]:
        if self._lists is not lists:
            self._lists, self._there = lists, (cuda.to_device(lists[0]), cuda.to_device(lists[1]))
        return self._there


def _blocks(particles: int) -> int:
    return -(-particles // THREADS_PER_BLOCK)
