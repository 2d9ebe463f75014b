"""Pulses from CSV files: a column of times and one of values, or several, whose header names the units."""

import csv
import math
import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import PulseError
from reflowshock.fem.loads.pulse import STANDARD_GRAVITY, Tabulated

MOST_LINES = 1_500_000
LONGEST = 60  # characters of a cell in an error
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# Units of each quantity, the SI unit first.
QUANTITIES: dict[str, dict[str, float]] = {
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3, "G": STANDARD_GRAVITY, "g": STANDARD_GRAVITY},
    "pressure": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3, "mm/ms": 1.0},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
}


def read_pulse(path: Path, quantity: str, column: str | None = None) -> Tabulated:
    """Read a tabulated pulse, e.g. ``time [ms], acceleration [G]`` or ``time_s,input_g,board_g`` and rows of numbers.

    A record that begins before its trigger, at a negative time, is moved: its first row is the start of the run.

    Args:
        path: CSV file; empty lines and lines that start with ``#`` are skipped. Times stand in the first column.
        quantity: What the column of values must be, a key of ``QUANTITIES``.
        column: Title of this column, with or without its unit; needed where there are several.

    Returns:
        The pulse in SI units; the same one, unless the file has changed since.

    Raises:
        PulseError: The file cannot be read, its header names no known unit or no such column, a row has not as many
            finite numbers as the header has titles, times do not increase, or there are fewer than two rows; with the
            line.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:
        raise PulseError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    pulse = _pulse_or_error(path, (quantity, column), (found.st_mtime_ns, found.st_size, found.st_ino))
    if isinstance(pulse, PulseError):
        raise pulse
    return pulse


Wanted = tuple[str, str | None]


@lru_cache(maxsize=4)
def _pulse_or_error(path: Path, wanted: Wanted, version: tuple[int, int, int]) -> Tabulated | PulseError:
    """Read a pulse of a version of its file, which a plan asks for many times; or return what is wrong with it."""
    try:
        return _pulse_of(path, wanted)
    except PulseError as error:
        return error


def _pulse_of(path: Path, wanted: Wanted) -> Tabulated:
    """Read a pulse; errors as ``read_pulse``."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise PulseError(f"{path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise PulseError(f"{path}: is not a text in UTF-8") from error
    if text.count("\n") > MOST_LINES:
        raise PulseError(f"{path}: has more than {MOST_LINES} lines")
    table = _read_at_once(path, text, wanted)
    if table is None:
        table = _read_rows(path, text, wanted)
    return Tabulated(table[:, 0] - min(table[0, 0], 0.0), table[:, 1].copy())


@dataclass(frozen=True, slots=True)
class Columns:
    """Of a table: how many columns it has, which one has the values, and the factors that make SI of times and them."""

    count: int
    value: int
    scales: tuple[float, float]


def _read_at_once(path: Path, text: str, wanted: Wanted) -> NDArray[np.float64] | None:
    """Return times and values ``(n, 2)`` in SI of a table without faults; None where a row has to be looked at."""
    lines = text.splitlines()
    head = next((k for k, line in enumerate(lines) if line.strip(", \t") and not line.lstrip().startswith("#")), None)
    if head is None:
        return None
    try:
        titles = [cell.strip() for cell in next(csv.reader(lines[head : head + 1]))]
        columns = read_header(path, head + 1, titles, wanted)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # a table without rows
            table = np.loadtxt(lines[head + 1 :], delimiter=",", comments="#", ndmin=2)
    except (ValueError, csv.Error, UserWarning):
        return None
    if table.shape[0] < 2 or table.shape[1] != columns.count or not np.isfinite(table).all():
        return None
    table = table[:, [0, columns.value]] * columns.scales
    return table if bool((np.diff(table[:, 0]) > 0.0).all()) and np.isfinite(table).all() else None


def _read_rows(path: Path, text: str, wanted: Wanted) -> NDArray[np.float64]:
    """Return times and values ``(n, 2)`` in SI, read row by row up to the first fault; errors as ``read_pulse``."""
    rows = _content(path, text)
    number, row = next(rows, (0, []))
    columns = read_header(path, number, [cell.strip() for cell in row], wanted) if row else Columns(2, 1, (1.0, 1.0))
    lines, table = [], []
    for number, row in rows:
        lines.append(number)
        table.append(read_row(path, number, row, columns))
    if len(table) < 2:
        count = len(table) + (number > 0)
        raise PulseError(f"{path}: a header and at least two rows are needed, found {count} lines with content")
    found = np.array(table)
    check_times(path, lines, found[:, 0])
    return found


def _content(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield number and cells of each line that is neither empty nor a comment."""
    try:
        for number, row in enumerate(csv.reader(text.splitlines()), start=1):
            if any(map(str.strip, row)) and not row[0].lstrip().startswith("#"):
                yield number, row
    except csv.Error as error:
        raise PulseError(f"{path}: is not a table of comma separated values: {error}") from error


def read_header(path: Path, number: int, row: Sequence[str], wanted: Wanted) -> Columns:
    """Return the columns of a table; errors as ``read_pulse``."""
    quantity, column = wanted
    if len(row) < 2:
        raise PulseError(f"{path}, line {number}: the header must name a column of times and one of values")
    value = 1 if len(row) == 2 else find_column(path, number, row, column)
    scales = read_unit(path, number, row[0], TIMES), read_unit(path, number, row[value], QUANTITIES[quantity])
    return Columns(len(row), value, scales)


def find_column(path: Path, number: int, row: Sequence[str], column: str | None) -> int:
    """Return which of several columns of values is meant; errors as ``read_pulse``."""
    titles, place = row[1:], f"{path}, line {number}"
    if column is None:
        raise PulseError(f"{place}: has several columns of values, {_listed(titles)}: name one of them as table_column")
    found = [k for k, title in enumerate(row) if k and column in (title, split_title(title)[0])]
    if len(found) != 1:
        near = get_close_matches(column, titles, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise PulseError(f"{place}: {len(found)} columns are titled {column!r}; titles are {_listed(titles)}{hint}")
    return found[0]


def _listed(titles: Sequence[str]) -> str:
    return shown(", ".join(titles))


def split_title(title: str) -> tuple[str, str]:
    """Return name and unit of a column, from ``name [unit]``, ``name (unit)`` or ``name_unit``."""
    found = re.search(r"^(.*?)\s*(?:[\[(]\s*([^\])]+?)\s*[\])]|_([A-Za-z]+))$", title)
    return (found.group(1), found.group(2) or found.group(3)) if found else (title, "")


def read_unit(path: Path, number: int, title: str, units: dict[str, float]) -> float:
    """Return the factor of the unit at the end of a column's title."""
    unit = split_title(title)[1]
    if unit not in units:
        near = get_close_matches(unit, units, n=1, cutoff=0.3)
        hint = f"; did you mean [{near[0]}]?" if near else ""
        raise PulseError(
            f"{path}, line {number}: column {shown(title)!r} needs its unit in brackets, "
            f"one of {', '.join(units)}{hint}"
        )
    return units[unit]


def read_row(path: Path, number: int, row: Sequence[str], columns: Columns) -> tuple[float, float]:
    """Return time and value of a row in SI; errors as ``read_pulse``."""
    try:
        if len(row) != columns.count:
            raise ValueError
        time, value = (float(row[k]) * scale for k, scale in zip((0, columns.value), columns.scales, strict=True))
    except ValueError:
        count = "two" if columns.count == 2 else columns.count
        raise PulseError(f"{path}, line {number}: {count} numbers are needed, found {shown(', '.join(row))}") from None
    if not (math.isfinite(time) and math.isfinite(value)):
        raise PulseError(f"{path}, line {number}: {shown(', '.join(row))} is not finite")
    return time, value


def check_times(path: Path, lines: Sequence[int], times: np.ndarray) -> None:
    """Refuse times ``(n,)`` [s] that do not increase; errors as ``read_pulse``."""
    wrong = np.flatnonzero(np.diff(times) <= 0.0)
    if len(wrong):
        k = int(wrong[0])
        raise PulseError(f"{path}, line {lines[k + 1]}: times must increase, {times[k + 1]:g} s follows {times[k]:g} s")


def shown(text: str) -> str:
    """Cut a text that would fill the terminal."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"
