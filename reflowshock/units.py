"""Units: conversion of strings such as "0.48 mm" to SI floats and back."""

import math
import re
from decimal import Decimal
from functools import cache, lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # slow to load, and not needed by MPI ranks
    import pint

# Bounded repetitions, since unbounded ones would take minutes for a megabyte of digits.
QUANTITY = re.compile(
    r"\s*(?P<number>[-+]?(?:[0-9]{1,400}(?:\.[0-9]{0,400})?|\.[0-9]{1,400})(?:[eE][-+]?[0-9]{1,9})?)"
    r"\s*(?P<unit>(?:\S(?:.*\S)?)?)\s*"
)
PATTERN = re.sub(r"\?P<\w+>", "", f"^{QUANTITY.pattern}$")  # for JSON schemas, without group names
COMMA = re.compile(r",\s*[0-9]")  # after the digits of a number: decimals, or thousands
FACTOR = r"[^\W\d]\w*(?:(?:\^|\*\*)-?\d)?"
UNIT = re.compile(rf"(?:1?\s*/\s*)?{FACTOR}(?:\s*[*/]\s*{FACTOR})*")
FLOAT_MAX, LARGEST_EXPONENT = 1.0e308, 1000
LONGEST = 1000  # maximum length of a quantity
LONGEST_UNIT = 64
# Spellings of units by users and in pint.
SPELLINGS = {"°C": "degC", "℃": "degC", "°F": "degF", "°": "deg", "µ": "u", "μ": "u", "·": "*", "²": "^2", "³": "^3"}
# Pint treats bits, per cent and turns as pure numbers.
ANGLES = ("radian", "milliradian", "degree", "grade", "turn", "arcminute", "arcsecond")
# Pure numbers that are allowed as factors in units of a dimension.
PURE_FACTORS = {"angle": ANGLES, "frequency": ("radian", "turn", "degree"), "thermal expansion": ("ppm", "percent")}


class UnitError(ValueError):
    """Invalid quantity: not a number with a unit of the expected dimension."""


@cache
def registry() -> "pint.UnitRegistry":
    """Return Pint's unit registry, in which ``G`` is the standard acceleration of gravity and ``mil`` is 0.001 inch."""
    import pint

    # With decimals, "0.04 mm" and "40 um" give the same float.
    units: pint.UnitRegistry = pint.UnitRegistry(
        on_redefinition="ignore", autoconvert_offset_to_baseunit=True, non_int_type=Decimal
    )
    units.define("standard_gravity = 9.80665 * meter / second**2 = G")
    units.define("thou = 0.001 * inch = mil = th")  # as in board drawings; in pint, mil is an angle
    return units


def to_si(text: object, unit: str) -> float:
    """Convert a quantity to its SI value.

    Args:
        text: A number and a unit, e.g. "0.48 mm".
        unit: Any unit of the expected dimension, e.g. "m".

    Returns:
        The float nearest to the value in SI base units (rad for angles, K for temperatures and for differences, e.g.
        "5 delta_degC").

    Raises:
        UnitError: Not a string, no number, no unit, unknown unit or another dimension.
    """
    if not isinstance(text, str):
        raise UnitError(f'needs a unit, as a string such as "{_plain(text)} {unit}"')
    match = QUANTITY.fullmatch(text) if len(text) <= LONGEST else None
    if match is None:
        raise UnitError(f'is not a number and a unit, such as "1 {unit}"')
    if COMMA.match(match["unit"]):
        raise UnitError(f'contains a comma; write decimals with a point, as "1.5 {unit}", and 1000 without')
    if not match["unit"]:
        raise UnitError(f'needs a unit, such as "{match["number"]} {unit}"')
    parsed = _parse_unit(match["unit"], unit)
    number = Decimal(match["number"])
    # Decimal arithmetic overflows at exponents of nine digits.
    value = float(number) if abs(number.adjusted()) > LARGEST_EXPONENT else float(_in_base_units(number, parsed))
    if not math.isfinite(value):
        raise UnitError("is not finite")
    if number and not value:
        raise UnitError("is too small to be distinguished from zero")
    return value


def quantity_in_si(value: float, unit: str) -> float:
    """Return the value in SI base units of a number in a unit, e.g. 0.001 for 1 and "mm"; any dimension is allowed."""
    return float(_in_base_units(Decimal(repr(float(value))), registry().Unit(unit)))


def from_si(value: float, unit: str, digits: int = 10) -> str:
    """Return an SI value as text in a unit, e.g. ``from_si(4.8e-4, "mm")`` is "0.48 mm".

    Args:
        value: Value in SI base units.
        unit: Unit of the text.
        digits: Number of significant digits.
    """
    return f"{in_unit(value, unit):.{digits}g} {unit}"


def in_unit(value: float, unit: str) -> float:
    """Return an SI value as a number in another unit, e.g. 0.48 for 4.8e-4 and "mm"; inf and nan do not change.

    Args:
        value: Value in SI base units.
        unit: Unit of the result.
    """
    if not math.isfinite(value):
        return value
    parsed, base = _with_its_base(unit)
    return float(registry().Quantity(Decimal(repr(float(value))), base).to(parsed).magnitude)


@lru_cache(maxsize=1024)
def _with_its_base(unit: str) -> "tuple[pint.Unit, pint.Unit]":
    """Return a unit and the SI base unit of the same dimension."""
    parsed = registry().Unit(unit)
    return parsed, registry().Unit(registry().get_base_units(parsed)[1])


@lru_cache(maxsize=1024)
def dimension(unit: "str | pint.Unit") -> str:
    """Return the name of a unit's dimension, e.g. "length" for "mm", or its formula if it has no name."""
    parsed = registry().Unit(unit)
    if parsed.dimensionless:
        return "angle" if str(parsed) in ANGLES else "pure number"
    for name, example in KINDS.items():
        if registry().Unit(example).dimensionality == parsed.dimensionality:
            return name
    return str(parsed.dimensionality).replace("[", "").replace("]", "")


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
    "stiffness per area": "N/m^3",
    "force": "N",
    "frequency": "Hz",
    "irradiance": "W/m^2",
}


@lru_cache(maxsize=1024)
def _parse_unit(text: str, target: str) -> "pint.Unit":
    import pint

    expected = f"expected {_article(dimension(target))}, e.g. in {target}"
    spelled = text
    for written, read in SPELLINGS.items():
        spelled = spelled.replace(written, read)
    names = re.findall(r"[^\W\d]\w*", spelled)  # "¼" matches as a letter but is not a valid name
    if len(spelled) > LONGEST_UNIT or UNIT.fullmatch(spelled) is None or not all(map(str.isidentifier, names)):
        raise UnitError(f'"{text[:LONGEST_UNIT]}" is not a unit; {expected}')
    try:
        parsed = registry().parse_units(re.sub(r"^1?\s*/", "1/", spelled))
    except pint.UndefinedUnitError as error:
        raise UnitError(f'"{text}" is not a known unit; {expected}') from error
    except (pint.PintError, ValueError, TypeError, ArithmeticError) as error:  # errors in products and powers
        raise UnitError(f'"{text}" is not a unit; {expected}') from error
    if parsed.dimensionality != registry().Unit(target).dimensionality or parsed == registry().Unit(""):
        raise UnitError(f"is {_article(dimension(parsed))}; {expected}")
    # Angles are dimensionless in SI, but "1", "5 percent" and "3 bit" are not angles, and "1 mm*deg" is not a length.
    pure = [name for name in dict(registry().Quantity(1, parsed).unit_items()) if registry().Unit(name).dimensionless]
    if foreign := [name for name in pure if name not in PURE_FACTORS.get(dimension(target), ())]:
        raise UnitError(f'"{text}" contains the bare number {foreign[0]}; {expected}')
    return parsed


def _in_base_units(number: Decimal, unit: "pint.Unit") -> Decimal:
    """Convert a number to SI base units; raise UnitError for products with offset units, such as degC/m."""
    import pint

    try:
        return registry().Quantity(number, unit).to_base_units().magnitude
    except (pint.PintError, ArithmeticError) as error:
        raise UnitError("cannot be converted to SI units") from error


def _article(noun: str) -> str:
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def _plain(value: object) -> str:
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < FLOAT_MAX
    return f"{value:g}" if is_number else "1"
