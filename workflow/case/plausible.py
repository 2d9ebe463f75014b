"""Plausible magnitudes of physical quantities, which reveal wrong units or digits before anything runs."""

from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache

from pydantic.fields import FieldInfo

from reflowshock.problem import Problem
from reflowshock.quantity import Quantity
from reflowshock.units import dimension, from_si, to_si
from reflowshock.workflow.case import fields
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.pulse_files import largest_values

FORCE = "--force"


@dataclass(frozen=True, slots=True)
class Range:
    """Smallest and largest plausible magnitude, as text with a unit; zero is always plausible."""

    low: str
    high: str


# Ranges by dimension, for packages, solder, boards and drops.
BY_DIMENSION = {
    "length": Range("1 nm", "10 m"),
    "volume": Range("1e-9 mm^3", "1 m^3"),
    "time": Range("1 ns", "1e5 s"),
    "velocity": Range("1 nm/s", "20 km/s"),
    "acceleration": Range("1e-6 m/s^2", "1e7 G"),
    "density": Range("0.1 kg/m^3", "3e4 kg/m^3"),
    "pressure": Range("1 mPa", "10 TPa"),
    "surface tension": Range("1e-3 N/m", "10 N/m"),
    "viscosity": Range("1 uPa*s", "10 kPa*s"),
    "temperature": Range("1 K", "5000 K"),
    "thermal expansion": Range("1e-3 ppm/K", "1e4 ppm/K"),
    "mass": Range("1 pg", "1000 kg"),
    "stiffness per area": Range("1 N/m^3", "1e20 N/m^3"),
    "force": Range("1 pN", "1 MN"),
    "frequency": Range("1e-6 Hz", "1e12 Hz"),
    "irradiance": Range("1e-3 W/m^2", "1e12 W/m^2"),
    "angle": Range("1e-9 rad", "1 turn"),
    "pure number": Range("1e-3 um/m", "1e6 um/m"),  # a strain
}
# Narrower ranges by the last name of a key.
BY_NAME = {
    "young_modulus*": Range("1 kPa", "10 TPa"),
    "shear_modulus*": Range("1 Pa", "10 TPa"),
    "stiffness_coefficient": Range("1e-18 s", "1 s"),
    "latent_heat": Range("10 J/kg", "1e7 J/kg"),
    "heat_capacity": Range("1 J/kg/K", "1e5 J/kg/K"),
    "conductivity": Range("1e-3 W/m/K", "1e4 W/m/K"),
    "dose": Range("1e-3 J/m^2", "1e7 J/m^2"),
    "explicit_step": Range("1e-15 s", "1 s"),
    "implicit_step": Range("1e-15 s", "1e3 s"),
}
# Ranges of numbers without a unit; the named ones may have negative values.
NUMBERS = (1e-12, 1e6)
NAMED_NUMBERS = {
    "poisson_ratio": (-0.99, 0.4999),  # for isotropic solids; the explicit time step vanishes at 0.5
    "constant": (1e-300, 1e300),  # for a fatigue law, whose unit depends on its exponent
}


def find_implausible(case: Case) -> Iterator[Problem]:
    """Yield a problem for each parameter whose value is outside of the plausible range of its physical dimension.

    Args:
        case: Case whose values are allowed; the user may confirm implausible ones with ``--force``.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    for key, value, field in fields.leaves(case):
        for number in _numbers(value):
            yield from _implausible(key, number, field)


def implausible_tables(case: Case) -> Iterator[Problem]:
    """Yield a problem for each pulse table whose last time or largest value is too large to be plausible.

    Args:
        case: Case with its pulse tables, which are read; the limit depends on the physical dimension.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    for key, unit, number in largest_values(case.pulse_tables):
        plausible = BY_DIMENSION[dimension(unit)]
        if number > to_si(plausible.high, unit):
            message = f"has {from_si(number, unit, 6)}, which is not plausible"
            yield Problem(key, message, None, f"up to {plausible.high}, or {FORCE}")


def _numbers(value: object) -> Iterator[float]:
    """Yield the nonzero numbers of a value or of nested lists."""
    if isinstance(value, tuple):
        for item in value:
            yield from _numbers(item)
    elif isinstance(value, int | float) and not isinstance(value, bool) and value != 0:
        yield value


def _implausible(key: str, number: float, field: FieldInfo) -> Iterator[Problem]:
    quantity, name = fields.quantity_of(field), key.rpartition(".")[2]
    if name in NAMED_NUMBERS:
        low, high = NAMED_NUMBERS[name]
        if not low <= number <= high:
            yield Problem(key, "is not plausible", number, f"{low:g} to {high:g}, or {FORCE}")
        return
    if quantity is None:
        (low, high), limits = NUMBERS, f"{NUMBERS[0]:g} to {NUMBERS[1]:g}"
    else:
        plausible = _range(name, quantity)
        low, high = quantity.to_si(plausible.low), quantity.to_si(plausible.high)
        limits = f"{plausible.low} to {plausible.high}"
    if not low <= abs(number) <= high:
        displayed = fields.display(float(number), field) if quantity else number
        yield Problem(key, "is not plausible", displayed, f"{limits} in magnitude, or {FORCE}")


@cache
def _range(name: str, quantity: Quantity) -> Range:
    """Return the plausible magnitudes of a quantity, by the last name of its key and its dimension."""
    by_name = next((range_of_name for pattern, range_of_name in BY_NAME.items() if fnmatchcase(name, pattern)), None)
    return by_name or BY_DIMENSION[quantity.dimension]
