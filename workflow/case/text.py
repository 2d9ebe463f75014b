"""Numbers as text: three or four digits and a unit that makes them readable."""

import re

CHECK_UNITS = {
    r".*peel_stress": "Pa", r".*plastic_work_density": "J/m^3", r"(\w+_)?frequency_\d+_(low|high)": "Hz",
    r"standoff_spread_.*": "m",
}  # fmt: skip
MICRO_UNIT = re.compile(r"\bu(?=[msgNJVA]\b)")
# Smaller units below a limit: limit, factor, unit.
LESS = {
    "s": ((1e-4, 1e6, "µs"), (0.1, 1e3, "ms")), "Pa": ((1e4, 1e-3, "kPa"),), "N": ((1.0, 1e3, "mN"),),
    "m": ((1e-4, 1e6, "µm"),), "m^3": ((1e-12, 1e15, "pL"),),
}  # fmt: skip
SHOWN = {
    "Pa": (1e-6, "MPa"), "m": (1e3, "mm"), "m^3": (1e9, "mm³"), "J": (1e3, "mJ"), "J/m^3": (1e-3, "kJ/m³"),
    "N m": (1e3, "N mm"), "kg": (1e6, "mg"), "B": (1e-9, "GB"),
}  # fmt: skip


def quantity(metric: dict) -> str:
    """Format a metric in a readable unit: stresses in MPa or kPa, lengths in mm or µm, small forces in mN.

    Args:
        metric: Record with ``value`` and its SI ``unit``; a text is returned as it is.
    """
    value, unit = metric["value"], metric["unit"]
    if isinstance(value, str):
        return value
    factor, unit_text = readable(unit, abs(value))
    return f"{number(factor * value)} {unit_text}".strip()


def readable(unit: str, size: float) -> tuple[float, str]:
    """Return factor and name of a readable unit, such as (1e-6, "MPa").

    Args:
        unit: SI unit.
        size: Magnitude of the value in this unit, which decides on the prefix.
    """
    smaller = ((factor, display_unit) for least, factor, display_unit in LESS.get(unit, ()) if 0.0 < size < least)
    return next(smaller, SHOWN.get(unit, (1.0, unit)))


def spelled(unit: str) -> str:
    """Return the printed form of a unit of a case file, such as µm for um."""
    return MICRO_UNIT.sub("µ", unit)


def number(value) -> str:
    """Format a number with four significant digits; integers with all digits, texts and None as ``str`` does."""
    if isinstance(value, bool | str) or value is None:
        return str(value)
    if isinstance(value, int):
        return f"{value:,}".replace(",", " ")
    return f"{value:.4g}"


def nano(seconds: float | None) -> str:
    """Format seconds as nanoseconds; None as a dash."""
    return "–" if seconds is None else f"{1e9 * seconds:.3g} ns"


def micro(value: float) -> str:
    """Format metres as micrometres with four digits, without the unit."""
    return _four_digits(1e6 * value)


def mega(value: float) -> str:
    """Format pascals as megapascals with four digits, without the unit."""
    return _four_digits(1e-6 * value)


def _four_digits(value: float) -> str:
    """Format a number of a column, with trailing zeros."""
    return f"{value:.0f}" if abs(value) >= 999.95 else f"{value:#.4g}"


def percent(value: float) -> str:
    """Format a fraction in per cent with three digits."""
    if abs(value) < 1.0e-6:
        return "< 0.0001 %"
    return f"{100.0 * value:.3g} %" if abs(value) < 10.0 else f"{100.0 * value:.0f} %"


def against_limit(name: str, check: dict) -> tuple[str, str]:
    """Return value and limit of a health check as text.

    Args:
        name: Name of the check, which decides on the unit.
        check: Record with ``value`` and ``limit``.
    """
    unit = next((unit for pattern, unit in CHECK_UNITS.items() if re.fullmatch(pattern, name)), "")
    value, limit = (quantity({"value": check[key], "unit": unit}) for key in ("value", "limit"))
    return value, limit


def duration(seconds: float) -> str:
    """Format a wall time [s] with two digits in a readable unit: s, min, h or days."""
    units = ((1.0, "s"), (60.0, "min"), (3600.0, "h"))
    size, unit = next(((s, u) for s, u in units if seconds < 100.0 * s), (86400.0, "days"))
    return f"{seconds / size:.2g} {unit}" if seconds < 100.0 * size else f"{seconds / size:.0f} {unit}"


def short(seconds: float) -> str:
    """Format a time step [s] with three digits in ns, µs or ms."""
    factor, unit = next(((f, u) for f, u in ((1e9, "ns"), (1e6, "µs")) if f * seconds < 1e3), (1e3, "ms"))
    return f"{factor * seconds:.3g} {unit}"
