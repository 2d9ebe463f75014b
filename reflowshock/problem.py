"""Input errors of all packages and their text for users."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from reflowshock.names import find_nearest

LONGEST = 120  # maximum length of a value or key in a message


@dataclass(frozen=True, slots=True)
class Problem:
    """Input error in a case file or on the command line.

    Attributes:
        key: Dotted key, e.g. "package.pitch"; empty for errors of the whole file.
        message: Description of the error.
        value: Value as written by the user; None for a missing value.
        allowed: Allowed range or dimension, or empty.
        hint: Nearest valid name, or empty.
        line: Line of the key in its file, counted from 1; None if unknown.
        column: Column of the key, counted from 1; None if unknown.
    """

    key: str
    message: str
    value: object = None
    allowed: str = ""
    hint: str = ""
    line: int | None = None
    column: int | None = None

    def __str__(self) -> str:
        key = shorten(self.key)
        location = key if self.value is None else f"{key} = {shorten(as_toml(self.value))}"
        parts = [": ".join(part for part in (location, self.message) if part)]
        if self.allowed:
            parts.append(f"allowed: {self.allowed}")
        if self.hint:
            parts.append(f"did you mean {self.hint}?")
        return one_line("; ".join(parts))

    @property
    def position(self) -> str:
        """Position in the form ":line:column" that editors understand; empty if unknown."""
        return "" if self.line is None else f":{self.line}:{self.column or 1}"


def unknown_name(key: str, name: str, valid: Iterable[str], what: str) -> Iterator[Problem]:
    """Yield a problem with the nearest valid name as hint if a name is unknown; yield nothing otherwise.

    Args:
        key: Dotted key of the problem.
        name: Name to check.
        valid: Valid names.
        what: Kind of the name for the message, e.g. "joint".
    """
    names = list(valid)
    if name not in names:
        yield Problem(key, f"no such {what}", name, "one of " + ", ".join(names), find_nearest(name, names))


def as_toml(value: object) -> str:
    """Return a value of a case file as TOML text for messages; tables are abbreviated.

    Args:
        value: Text, number, boolean, list or table.
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, dict):
        return "{ … }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(as_toml(item) for item in value) + "]"
    if isinstance(value, int) and value.bit_length() > 1000:  # Python does not convert integers of thousands of digits
        return f"{'-' if value < 0 else ''}{abs(value) >> (value.bit_length() - 30)}…"
    return str(value)


def shorten(text: str) -> str:
    """Return a text, cut to at most ``LONGEST`` characters for messages if it is longer."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def one_line(text: str) -> str:
    """Return a text with unprintable characters, such as line breaks and control characters, replaced by escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
