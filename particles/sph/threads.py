"""The loops over particles, on threads.

Results are written into arguments: Numba drops a parallel loop that writes into arrays of a tuple alone.
"""

from numba import njit, prange

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.particle_rates import drift_of, rates_of, wall_values
from reflowshock.particles.sph.shear_viscosity import viscosity_of


class ThreadLoops:
    """The loops over particles of a law, on threads."""

    def __init__(self, law: Law) -> None:
        self._law = law

    def find_rates(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, rates: Floats) -> None:
        """Write what `rates_of` returns of each particle of the liquid into rows of ``rates`` `(10, n)`."""
        _find_rates(fluids, lists, fields, self._law, rates)

    def find_wall_values(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, found: Floats) -> None:
        """Write what `wall_values` returns of each particle of walls into rows of ``found`` `(5, m)`."""
        _find_wall_values(fluids, lists, fields, self._law, found)

    def find_viscosities(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, found: Floats) -> None:
        """Write the viscosity of each particle of the liquid into the row of ``found`` `(1, n)`."""
        _find_viscosities(fluids, lists, fields, self._law, found)

    def find_drifts(self, fluids: int, lists: tuple[Indices, Indices], fields: Fields, found: Floats) -> None:
        """Write what `drift_of` returns of each particle of the liquid into rows of ``found`` `(3, n)`."""
        _find_drifts(fluids, lists, fields, self._law, found)


@njit(cache=True, parallel=True, error_model="numpy")
def _find_rates(fluids, lists, fields, law, rates):
    offsets, indices = lists
    for i in prange(fluids):
        found = rates_of(i, fluids, indices[offsets[i] : offsets[i + 1]], fields, law)
        for k in range(10):
            rates[k, i] = found[k]


@njit(cache=True, parallel=True, error_model="numpy")
def _find_viscosities(fluids, lists, fields, law, found):
    offsets, indices = lists
    for i in prange(fluids):
        found[0, i] = viscosity_of(i, fluids, indices[offsets[i] : offsets[i + 1]], fields, law)


@njit(cache=True, parallel=True, error_model="numpy")
def _find_drifts(fluids, lists, fields, law, found):
    offsets, indices = lists
    for i in prange(fluids):
        drift = drift_of(i, fluids, indices[offsets[i] : offsets[i + 1]], fields, law)
        for k in range(found.shape[0]):
            found[k, i] = drift[k]


@njit(cache=True, parallel=True, error_model="numpy")
def _find_wall_values(fluids, lists, fields, law, found):
    offsets, indices = lists
    for i in prange(fluids, fields.x.shape[0]):
        values = wall_values(i, fluids, indices[offsets[i] : offsets[i + 1]], fields, law)
        for k in range(found.shape[0]):
            found[k, i - fluids] = values[k]
