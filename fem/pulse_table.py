"""Pulses from CSV files: two columns, time and value, whose header names the units."""

import csv
import re
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from fem.errors import PulseError
from fem.pulse import STANDARD_GRAVITY, Tabulated

TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
QUANTITIES: dict[str, dict[str, float]] = {
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3, "G": STANDARD_GRAVITY},
    "pressure": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3, "mm/ms": 1.0},
}


def read_pulse(path: Path, quantity: str) -> Tabulated:
    """Read a tabulated pulse, e.g. ``time [ms], acceleration [G]`` and then rows of two numbers.

    Args:
        path: CSV file; empty lines and lines that start with ``#`` are skipped.
        quantity: What the second column must be, a key of ``QUANTITIES``.

    Returns:
        The pulse in SI units.

    Raises:
        PulseError: The file cannot be read, its header names no known unit, a row is not two finite numbers, times are
            negative or do not increase, or there are fewer than two rows; with the line.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise PulseError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    lines = [
        (number, [cell.strip() for cell in row])
        for number, row in enumerate(csv.reader(text.splitlines()), start=1)
        if any(cell.strip() for cell in row) and not row[0].lstrip().startswith("#")
    ]
    if len(lines) < 3:
        raise PulseError(f"{path}: a header and at least two rows are needed, found {len(lines)} lines with content")
    scales = read_header(path, *lines[0], quantity)
    table = np.array([read_row(path, number, row) for number, row in lines[1:]]) * scales
    check_times(path, [number for number, _ in lines[1:]], table[:, 0])
    return Tabulated(table[:, 0].copy(), table[:, 1].copy())


def read_header(path: Path, number: int, row: Sequence[str], quantity: str) -> tuple[float, float]:
    """Return the factors that make SI values of both columns; errors as ``read_pulse``."""
    if len(row) != 2:
        raise PulseError(f"{path}, line {number}: the header must name two columns, found {len(row)}")
    return read_unit(path, number, row[0], TIMES), read_unit(path, number, row[1], QUANTITIES[quantity])


def read_unit(path: Path, number: int, title: str, units: dict[str, float]) -> float:
    """Return the factor of the unit in brackets at the end of a column's title."""
    found = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]$", title)
    unit = found.group(1) if found else ""
    if unit not in units:
        near = get_close_matches(unit, units, n=1, cutoff=0.3)
        hint = f"; did you mean [{near[0]}]?" if near else ""
        raise PulseError(
            f"{path}, line {number}: column {title!r} needs its unit in brackets, one of {', '.join(units)}{hint}"
        )
    return units[unit]


def read_row(path: Path, number: int, row: Sequence[str]) -> tuple[float, float]:
    """Return the two numbers of a row; errors as ``read_pulse``."""
    try:
        time, value = (float(cell) for cell in row)
    except ValueError:
        raise PulseError(f"{path}, line {number}: two numbers are needed, found {', '.join(row)}") from None
    if not (np.isfinite(time) and np.isfinite(value)):
        raise PulseError(f"{path}, line {number}: {', '.join(row)} is not finite")
    return time, value


def check_times(path: Path, lines: Sequence[int], times: np.ndarray) -> None:
    """Refuse times ``(n,)`` [s] that are negative or do not increase; errors as ``read_pulse``."""
    if times[0] < 0.0:
        raise PulseError(f"{path}, line {lines[0]}: time {times[0]:g} s is before the start, times must be >= 0")
    wrong = np.flatnonzero(np.diff(times) <= 0.0)
    if len(wrong):
        k = int(wrong[0])
        raise PulseError(f"{path}, line {lines[k + 1]}: times must increase, {times[k + 1]:g} s follows {times[k]:g} s")
