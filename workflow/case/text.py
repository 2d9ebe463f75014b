"""Numbers as text: three or four digits and a unit that makes them readable."""

import re

CHECK_UNITS = {
    r".*peel_stress": "Pa", r".*plastic_work_density": "J/m^3", r"(\w+_)?frequency_\d+_(low|high)": "Hz",
    r"standoff_spread_.*": "m",
}  # fmt: skip
MICRO_UNIT = re.compile(r"\bu(?=[msgNJVA]\b)")
# Below so much another unit reads better.
LESS = {
    "s": ((1e-4, 1e6, "µs"), (0.1, 1e3, "ms")), "Pa": ((1e4, 1e-3, "kPa"),), "N": ((1.0, 1e3, "mN"),),
    "m": ((1e-4, 1e6, "µm"),), "m^3": ((1e-12, 1e15, "pL"),),
}  # fmt: skip
SHOWN = {
    "Pa": (1e-6, "MPa"), "m": (1e3, "mm"), "m^3": (1e9, "mm³"), "J": (1e3, "mJ"), "J/m^3": (1e-3, "kJ/m³"),
    "N m": (1e3, "N mm"), "kg": (1e6, "mg"), "B": (1e-9, "GB"),
}  # fmt: skip


def quantity(metric: dict) -> str:
    """Text of a metric record: fractions as per cent, stresses in MPa or kPa, lengths in mm or µm, small forces mN."""
    value, unit = metric["value"], metric["unit"]
    if isinstance(value, str):
        return value
    factor, shown = readable(unit, abs(value))
    return f"{number(factor * value)} {shown}".strip()


def readable(unit: str, size: float) -> tuple[float, str]:
    """Return by what values of a size in an SI unit are multiplied, and in which unit they then read well."""
    smaller = ((factor, shown) for least, factor, shown in LESS.get(unit, ()) if 0.0 < size < least)
    return next(smaller, SHOWN.get(unit, (1.0, unit)))


def spelled(unit: str) -> str:
    """Return a unit as a case names it, as it is printed: um as µm."""
    return MICRO_UNIT.sub("µ", unit)


def number(value) -> str:
    """Four significant digits, without a needless exponent."""
    if isinstance(value, bool | str) or value is None:
        return str(value)
    if isinstance(value, int):
        return f"{value:,}".replace(",", " ")
    return f"{value:.4g}"


def nano(seconds: float | None) -> str:
    """Seconds as nanoseconds."""
    return "–" if seconds is None else f"{1e9 * seconds:.3g} ns"


def micro(value: float) -> str:
    """Metres as micrometres, four digits."""
    return _four_digits(1e6 * value)


def mega(value: float) -> str:
    """Pascals as megapascals, four digits."""
    return _four_digits(1e-6 * value)


def _four_digits(value: float) -> str:
    """Write a figure of a column: with the zeros at its end."""
    return f"{value:.0f}" if abs(value) >= 999.95 else f"{value:#.4g}"


def percent(value: float) -> str:
    """Format a fraction in per cent with three digits."""
    if abs(value) < 1.0e-6:
        return "< 0.0001 %"
    return f"{100.0 * value:.3g} %" if abs(value) < 10.0 else f"{100.0 * value:.0f} %"


def against_limit(name: str, check: dict) -> tuple[str, str]:
    """Return value and limit of a check."""
    unit = next((unit for pattern, unit in CHECK_UNITS.items() if re.fullmatch(pattern, name)), "")
    value, limit = (quantity({"value": check[key], "unit": unit}) for key in ("value", "limit"))
    return value, limit


def duration(seconds: float) -> str:
    """Write a wall time with two digits, in the unit that makes its figure readable."""
    units = ((1.0, "s"), (60.0, "min"), (3600.0, "h"))
    size, unit = next(((s, u) for s, u in units if seconds < 100.0 * s), (86400.0, "days"))
    return f"{seconds / size:.2g} {unit}" if seconds < 100.0 * size else f"{seconds / size:.0f} {unit}"


def short(seconds: float) -> str:
    """Write a time step in the unit that makes its figure readable."""
    factor, unit = next(((f, u) for f, u in ((1e9, "ns"), (1e6, "µs")) if f * seconds < 1e3), (1e3, "ms"))
    return f"{factor * seconds:.3g} {unit}"
