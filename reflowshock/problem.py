"""One mistake in what the program is given, as the user reads it: the same record for all packages."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from reflowshock.names import nearest

LONGEST = 120  # characters of a value or key in a message


@dataclass(frozen=True, slots=True)
class Problem:
    """One mistake in a case file or on the command line.

    Attributes:
        key: dotted key, e.g. "package.pitch"; empty where the file as a whole is meant.
        message: what is wrong.
        value: the value as the user wrote it; None where a value is missing.
        allowed: allowed range or dimension, or empty.
        hint: the nearest valid name, or empty.
        line: where the key stands in its file, from 1 on; None where it is not known.
        column: the same in the line.
    """

    key: str
    message: str
    value: object = None
    allowed: str = ""
    hint: str = ""
    line: int | None = None
    column: int | None = None

    def __str__(self) -> str:
        key = shortened(self.key)
        place = key if self.value is None else f"{key} = {shortened(as_toml(self.value))}"
        parts = [": ".join(part for part in (place, self.message) if part)]
        if self.allowed:
            parts.append(f"allowed: {self.allowed}")
        if self.hint:
            parts.append(f"did you mean {self.hint}?")
        return one_line("; ".join(parts))

    @property
    def position(self) -> str:
        """Return ":line:column", as editors read it; empty where it is not known."""
        return "" if self.line is None else f":{self.line}:{self.column or 1}"


def unknown_name(key: str, name: str, valid: Iterable[str], what: str) -> Iterator[Problem]:
    """Yield a problem where a name is not among the valid ones."""
    names = list(valid)
    if name not in names:
        yield Problem(key, f"no such {what}", name, "one of " + ", ".join(names), nearest(name, names))


def as_toml(value: object) -> str:
    """Write a value as a user wrote it in TOML; of a table only that it is one."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, dict):
        return "{ … }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(as_toml(item) for item in value) + "]"
    if isinstance(value, int) and value.bit_length() > 1000:  # Python refuses to write those of thousands of digits
        return f"{'-' if value < 0 else ''}{abs(value) >> (value.bit_length() - 30)}…"
    return str(value)


def shortened(text: str) -> str:
    """Cut a text that would fill the terminal."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def one_line(text: str) -> str:
    """Write characters that move the cursor, or that no terminal shows, as their escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
