"""Pulses from CSV files: a column of times and one or more columns of values, with units in the header."""

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
LONGEST = 60  # characters of a cell in an error message
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

    A record with times before its trigger (negative times) is shifted, so that its first row is the start of the run.

    Args:
        path: CSV file with times in its first column; empty lines and lines that start with ``#`` are skipped.
        quantity: Quantity of the values, a key of ``QUANTITIES``.
        column: Title of the column of values, with or without its unit; None if there is only one such column.

    Returns:
        Pulse in SI units, read again only if the file has changed.

    Raises:
        PulseError: The file cannot be read, a unit is unknown, no or several columns have the title, a row does not
            have one finite number per title, times do not increase, or there are fewer than two rows. The message
            names the line.
    """
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        raise PulseError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    source = TableColumn(path, quantity, column)
    pulse = _pulse_or_error(source, (status.st_mtime_ns, status.st_size, status.st_ino))
    if isinstance(pulse, PulseError):
        raise pulse
    return pulse


@dataclass(frozen=True, slots=True)
class TableColumn:
    """Column of values in a CSV file.

    Attributes:
        path: CSV file.
        quantity: Quantity of the values, a key of ``QUANTITIES``.
        title: Title of the column, with or without its unit; None if there is only one column of values.
    """

    path: Path
    quantity: str
    title: str | None


@lru_cache(maxsize=4)
def _pulse_or_error(source: TableColumn, version: tuple[int, int, int]) -> Tabulated | PulseError:
    """Return the pulse of one version of a file, or the error; cached because a plan reads it many times."""
    try:
        return _pulse_of(source)
    except PulseError as error:
        return error


def _pulse_of(source: TableColumn) -> Tabulated:
    """Read a pulse; errors as ``read_pulse``."""
    path = source.path
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise PulseError(f"{path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise PulseError(f"{path}: is not a UTF-8 text file") from error
    if text.count("\n") > MOST_LINES:
        raise PulseError(f"{path}: has more than {MOST_LINES} lines")
    table = _read_at_once(source, text)
    if table is None:
        table = _read_rows(source, text)
    return Tabulated(table[:, 0] - min(table[0, 0], 0.0), table[:, 1].copy())


@dataclass(frozen=True, slots=True)
class Columns:
    """Columns of a table.

    Attributes:
        count: Number of columns.
        value: Index of the column of values.
        scales: Factors that convert times and values to SI units.
    """

    count: int
    value: int
    scales: tuple[float, float]


def _read_at_once(source: TableColumn, text: str) -> NDArray[np.float64] | None:
    """Return times and values ``(n, 2)`` in SI units, or None if the table has errors that ``_read_rows`` reports."""
    lines = text.splitlines()
    head = next((k for k, line in enumerate(lines) if line.strip(", \t") and not line.lstrip().startswith("#")), None)
    if head is None:
        return None
    try:
        titles = [cell.strip() for cell in next(csv.reader(lines[head : head + 1]))]
        columns = _read_header(source, head + 1, titles)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # a table without rows
            table = np.loadtxt(lines[head + 1 :], delimiter=",", comments="#", ndmin=2)
    except (ValueError, csv.Error, UserWarning):
        return None
    if table.shape[0] < 2 or table.shape[1] != columns.count or not np.isfinite(table).all():
        return None
    table = table[:, [0, columns.value]] * columns.scales
    return table if bool((np.diff(table[:, 0]) > 0.0).all()) and np.isfinite(table).all() else None


def _read_rows(source: TableColumn, text: str) -> NDArray[np.float64]:
    """Return times and values ``(n, 2)`` in SI units, read row by row; raises as ``read_pulse`` at the first error."""
    path, rows = source.path, _content(source.path, text)
    number, row = next(rows, (0, []))
    columns = _read_header(source, number, [cell.strip() for cell in row]) if row else Columns(2, 1, (1.0, 1.0))
    lines, pairs = [], []
    for number, row in rows:
        lines.append(number)
        pairs.append(_read_row(path, number, row, columns))
    if len(pairs) < 2:
        count = len(pairs) + (number > 0)
        raise PulseError(f"{path}: a header and at least two rows are needed, found {count} lines with content")
    table = np.array(pairs)
    _check_times(path, lines, table[:, 0])
    return table


def _content(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of each line that is neither empty nor a comment."""
    try:
        for number, row in enumerate(csv.reader(text.splitlines()), start=1):
            if any(map(str.strip, row)) and not row[0].lstrip().startswith("#"):
                yield number, row
    except csv.Error as error:
        raise PulseError(f"{path}: is not a table of comma separated values: {error}") from error


def _read_header(source: TableColumn, number: int, row: Sequence[str]) -> Columns:
    """Return the columns of a table from the titles in line ``number``; raises as ``read_pulse``."""
    path = source.path
    if len(row) < 2:
        raise PulseError(f"{path}, line {number}: the header must name a column of times and one of values")
    value = 1 if len(row) == 2 else _find_column(path, number, row, source.title)
    scales = _read_unit(path, number, row[0], TIMES), _read_unit(path, number, row[value], QUANTITIES[source.quantity])
    return Columns(len(row), value, scales)


def _find_column(path: Path, number: int, row: Sequence[str], column: str | None) -> int:
    """Return the index of the column with a title, with or without its unit; raises as ``read_pulse``."""
    titles, line = row[1:], f"{path}, line {number}"
    if column is None:
        raise PulseError(f"{line}: has several columns of values, {_listed(titles)}: name one of them as table_column")
    matches = [k for k, title in enumerate(row) if k and column in (title, _split_title(title)[0])]
    if len(matches) != 1:
        near = get_close_matches(column, titles, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise PulseError(f"{line}: {len(matches)} columns are titled {column!r}; titles are {_listed(titles)}{hint}")
    return matches[0]


def _listed(titles: Sequence[str]) -> str:
    return _abbreviate(", ".join(titles))


def _split_title(title: str) -> tuple[str, str]:
    """Return name and unit of a column titled ``name [unit]``, ``name (unit)`` or ``name_unit``; unit "" if none."""
    match = re.search(r"^(.*?)\s*(?:[\[(]\s*([^\])]+?)\s*[\])]|_([A-Za-z]+))$", title)
    return (match.group(1), match.group(2) or match.group(3)) if match else (title, "")


def _read_unit(path: Path, number: int, title: str, units: dict[str, float]) -> float:
    """Return the factor to SI of the unit in a column title; raises as ``read_pulse``."""
    unit = _split_title(title)[1]
    if unit not in units:
        near = get_close_matches(unit, units, n=1, cutoff=0.3)
        hint = f"; did you mean [{near[0]}]?" if near else ""
        raise PulseError(
            f"{path}, line {number}: column {_abbreviate(title)!r} needs its unit in brackets, "
            f"one of {', '.join(units)}{hint}"
        )
    return units[unit]


def _read_row(path: Path, number: int, row: Sequence[str], columns: Columns) -> tuple[float, float]:
    """Return time and value of a row in SI units; raises as ``read_pulse``."""
    try:
        if len(row) != columns.count:
            raise ValueError
        time, value = (float(row[k]) * scale for k, scale in zip((0, columns.value), columns.scales, strict=True))
    except ValueError:
        count = "two" if columns.count == 2 else columns.count
        cells = _abbreviate(", ".join(row))
        raise PulseError(f"{path}, line {number}: {count} numbers are needed, found {cells}") from None
    if not (math.isfinite(time) and math.isfinite(value)):
        raise PulseError(f"{path}, line {number}: {_abbreviate(', '.join(row))} is not finite")
    return time, value


def _check_times(path: Path, lines: Sequence[int], times: np.ndarray) -> None:
    """Check that times ``(n,)`` [s] increase; raises as ``read_pulse``, with the line of the first that does not."""
    wrong = np.flatnonzero(np.diff(times) <= 0.0)
    if len(wrong):
        k = int(wrong[0])
        raise PulseError(f"{path}, line {lines[k + 1]}: times must increase, {times[k + 1]:g} s follows {times[k]:g} s")


def _abbreviate(text: str) -> str:
    """Return a text cut to ``LONGEST`` characters with an ellipsis."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"
