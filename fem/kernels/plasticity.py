"""Compiled laws of ``materials.plasticity``: yield stress and implicit radial return of J2 plasticity."""

from numba import njit
from numba.extending import register_jitable

from reflowshock.fem.kernels.hexahedron import FINITE
from reflowshock.materials import plasticity as laws

SERIES_OPTIONS = {"fastmath": FINITE, "error_model": "numpy"}

register_jitable(**SERIES_OPTIONS)(laws.small_power)  # for the call in ``plastic_increment``
small_power = njit(cache=True, **SERIES_OPTIONS)(laws.small_power)
yield_stress = njit(cache=True)(laws.yield_stress)
plastic_increment = njit(cache=True)(laws.plastic_increment)
