"""One impossible value, as it is told to the user."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from reflowshock.fem.names import nearest


@dataclass(frozen=True, slots=True)
class Problem:
    """One impossible value.

    Attributes:
        key: Dotted key as in the case file.
        value: What was given; None where a value is missing.
        message: What is wrong.
        allowed: The allowed range or names, or empty.
        hint: The nearest valid name, or empty.
    """

    key: str
    value: object
    message: str
    allowed: str = ""
    hint: str = ""

    def __str__(self) -> str:
        parts = [f"{self.key} = {self.value}" if self.value is not None else self.key]
        parts[0] += f": {self.message}"
        parts += [f"allowed: {self.allowed}"] if self.allowed else []
        parts += [f"did you mean {self.hint}?"] if self.hint else []
        return "; ".join(parts)


def unknown_name(key: str, name: str, valid: Iterable[str], what: str) -> Iterator[Problem]:
    """Yield a problem where a name is not among the valid ones."""
    names = list(valid)
    if name not in names:
        yield Problem(key, name, f"no such {what}", "one of " + ", ".join(names), nearest(name, names))
