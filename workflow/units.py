"""Units: strings such as "0.48 mm" become SI floats, once, and SI floats become such strings again."""

import math
import re
from functools import cache

import pint

QUANTITY = re.compile(r"\s*(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?P<unit>.*?)\s*")
FACTOR = r"[^\W\d]\w*(?:(?:\^|\*\*)-?\d)?"
UNIT = re.compile(rf"{FACTOR}(?:\s*[*/]\s*{FACTOR})*")


class UnitError(ValueError):
    """A value that is not a number with a unit of the wanted dimension."""


@cache
def registry() -> pint.UnitRegistry:
    """Return the unit registry; G is the standard acceleration of gravity, as in shock specifications."""
    units: pint.UnitRegistry = pint.UnitRegistry(on_redefinition="ignore", autoconvert_offset_to_baseunit=True)
    units.define("standard_gravity = 9.80665 * meter / second**2 = G")
    return units


def to_si(text: object, unit: str) -> float:
    """Convert a quantity to its SI value.

    Args:
        text: a number and a unit, e.g. "0.48 mm".
        unit: any unit of the wanted dimension, e.g. "m".

    Returns:
        The value in SI base units (rad for angles, K for temperatures and for differences, e.g. "5 delta_degC").

    Raises:
        UnitError: not a string, no number, no unit, unknown unit or another dimension.
    """
    if not isinstance(text, str):
        raise UnitError(f'needs a unit, as a string such as "{_plain(text)} {unit}"')
    match = QUANTITY.fullmatch(text)
    if match is None:
        raise UnitError(f'is not a number and a unit, such as "1 {unit}"')
    if not match["unit"]:
        raise UnitError(f'needs a unit, such as "{match["number"]} {unit}"')
    parsed = _parse_unit(match["unit"], unit)
    value = registry().Quantity(float(match["number"]), parsed).to_base_units().magnitude
    if not math.isfinite(value):
        raise UnitError("is not finite")
    return float(value)


def from_si(value: float, unit: str, digits: int = 10) -> str:
    """Write an SI value in a unit, e.g. ``from_si(4.8e-4, "mm")`` is "0.48 mm"."""
    return f"{in_unit(value, unit):.{digits}g} {unit}"


def in_unit(value: float, unit: str) -> float:
    """Return the magnitude of an SI value in a unit."""
    parsed = registry().Unit(unit)
    base = registry().get_base_units(parsed)[1]
    return float(registry().Quantity(value, base).to(parsed).magnitude)


def dimension(unit: str | pint.Unit) -> str:
    """Name the dimension of a unit: "length" for "mm", "acceleration" for "G"; else its formula."""
    wanted = registry().Unit(unit)
    if wanted.dimensionless:
        return "pure number" if wanted == registry().Unit("") else "angle"
    for name, example in KINDS.items():
        if registry().Unit(example).dimensionality == wanted.dimensionality:
            return name
    return str(wanted.dimensionality).replace("[", "").replace("]", "")


KINDS = {
    "length": "m",
    "volume": "m^3",
    "time": "s",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "density": "kg/m^3",
    "pressure": "Pa",
    "surface tension": "N/m",
    "viscosity": "Pa*s",
    "temperature": "K",
    "thermal expansion": "ppm/K",
    "mass": "kg",
    "force": "N",
    "frequency": "Hz",
}


def _parse_unit(text: str, wanted: str) -> pint.Unit:
    expected = f"wanted is {_article(dimension(wanted))}, e.g. in {wanted}"
    if UNIT.fullmatch(text) is None:
        raise UnitError(f'"{text}" is not a unit; {expected}')
    try:
        parsed = registry().parse_units(text)
    except pint.UndefinedUnitError as error:
        raise UnitError(f'"{text}" is not a known unit; {expected}') from error
    # An angle has no dimension in SI, yet "1" is no angle and "1 deg" is no length.
    if parsed.dimensionality != registry().Unit(wanted).dimensionality or parsed == registry().Unit(""):
        raise UnitError(f"is {_article(dimension(parsed))}; {expected}")
    return parsed


def _article(noun: str) -> str:
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def _plain(value: object) -> str:
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return f"{value:g}" if is_number else "1"
