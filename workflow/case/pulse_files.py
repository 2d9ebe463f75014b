"""Checks of the pulse tables of a case: readability and largest values."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from reflowshock.problem import Problem

Tables = Mapping[str, tuple[Path, str, str | None]]


def unreadable_pulses(tables: Tables) -> Iterator[Problem]:
    """Yield a problem for each table that cannot be read.

    Args:
        tables: Dotted key -> path of the table, its quantity, and column title (None for a table with a single column).

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    from reflowshock.fem.errors import PulseError
    from reflowshock.fem.loads.pulse_table import read_pulse

    for key, (path, quantity, column) in tables.items():
        try:
            read_pulse(path, quantity, column)
        except PulseError as error:
            message = str(error).removeprefix(str(path)).lstrip(":, ")
            yield Problem(key, message, str(path))


def largest_values(tables: Tables) -> Iterator[tuple[str, str, float]]:
    """Yield the last time and the largest value of each table that can be read.

    Args:
        tables: Dotted key -> path of the table, its quantity, and column title (None for a table with a single column).

    Yields:
        Two items per table: dotted key, SI unit ("s" for the time), magnitude.
    """
    from reflowshock.fem.errors import PulseError
    from reflowshock.fem.loads.pulse_table import QUANTITIES, read_pulse

    for key, (path, quantity, column) in tables.items():
        try:
            pulse = read_pulse(path, quantity, column)
        except PulseError:
            continue
        yield key, "s", float(pulse.times[-1])
        yield key, next(iter(QUANTITIES[quantity])), float(abs(pulse.values).max())
