"""Tables of pulses that a case names: whether they can be read, and how large what they hold is."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from reflowshock.problem import Problem

Tables = Mapping[str, tuple[Path, str, str | None]]


def unreadable_pulses(tables: Tables) -> Iterator[Problem]:
    """Find tables that cannot be read.

    Args:
        tables: key -> file, what it holds, and the title of the column where it has several.
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
    """Yield key, SI unit and magnitude of the last time and of the largest value of each table that can be read."""
    from reflowshock.fem.errors import PulseError
    from reflowshock.fem.loads.pulse_table import QUANTITIES, read_pulse

    for key, (path, quantity, column) in tables.items():
        try:
            pulse = read_pulse(path, quantity, column)
        except PulseError:
            continue
        yield key, "s", float(pulse.times[-1])
        yield key, next(iter(QUANTITIES[quantity])), float(abs(pulse.values).max())
