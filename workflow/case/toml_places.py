"""Positions of keys in a TOML file, which the standard library does not provide."""

import re
import time
import tomllib
from ast import literal_eval
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

MOST_SECONDS = 1.0  # messages without a position are still correct
NAMES = re.compile(r"\(['\"].*\)")  # names of a table in errors of the parser
INLINE = "Duplicate inline table key "
AT = re.compile(r"\(at line (\d+), column (\d+)\)$")


@dataclass(frozen=True, slots=True)
class Place:
    """Position in a file: line and column, counted from 1."""

    line: int
    column: int


def place_of_error(error: tomllib.TOMLDecodeError, text: str) -> Place:
    """Return line and column of a TOML error; the end of the text if the error has none.

    Args:
        error: Error of ``tomllib``.
        text: The parsed text.
    """
    match = AT.search(str(error))
    return Place(int(match[1]), int(match[2])) if match else Place(text.count("\n") + 1, 1)


def toml_fault(error: tomllib.TOMLDecodeError, text: str) -> tuple[str, str]:
    """Return key (or an empty string) and message of a TOML error, without its position.

    Args:
        error: Error of ``tomllib``.
        text: The parsed text.
    """
    message = AT.sub("", str(error)).strip()
    has_value = "this key already has a value"
    if names := NAMES.search(message):
        return ".".join(literal_eval(names[0])), "this table is declared twice" if "declare" in message else has_value
    if message.startswith(INLINE):
        return literal_eval(message.removeprefix(INLINE)), has_value
    if message.startswith("Cannot overwrite"):
        return _key_in(text.split("\n")[place_of_error(error, text).line - 1]), has_value
    return "", message[:1].lower() + message[1:]


def _key_in(line: str) -> str:
    """Return the first key defined in a line, or an empty string."""
    with suppress(ValueError, RecursionError):
        return next(_keys(tomllib.loads(line), ""), "")
    return ""


class Places:
    """Positions of all keys of a valid TOML text.

    Every table header and every "key = value" is valid TOML by itself: lines are joined until they can be parsed.
    """

    def __init__(self, text: str) -> None:
        self._places: dict[str, Place] = {}
        table = ""
        for line, chunk, content in _expressions(text):
            is_head = chunk.lstrip().startswith("[")
            before = "" if is_head else table
            names = list(_keys(content, before))
            if is_head:
                table = names[-1] if names else ""
            for name in names:
                self._places.setdefault(name, Place(line, _column(chunk, name)))

    def __call__(self, key: str) -> Place | None:
        """Return the position of a dotted key or of the nearest enclosing table, or None at the top level."""
        while key:
            if key in self._places:
                return self._places[key]
            key = key.rpartition(".")[0]
        return None


def _expressions(text: str) -> Iterator[tuple[int, str, dict]]:
    """Yield first line, text and parsed content of each table header and each key with its value."""
    deadline = time.monotonic() + MOST_SECONDS
    lines = [f"{line}\n" for line in text.split("\n")]
    start = 0
    while start < len(lines):
        content = None
        for end in range(start + 1, len(lines) + 1):
            if time.monotonic() > deadline:
                return
            chunk = "".join(lines[start:end])
            try:
                content = tomllib.loads(chunk)
            except (ValueError, RecursionError):
                continue
            break
        if content:
            yield start + 1, chunk, content
        start = end


def _keys(content: object, before: str) -> Iterator[str]:
    """Yield the dotted keys in a table, each after its enclosing keys."""
    while isinstance(content, list) and len(content) == 1:  # the head of a list of tables
        content = content[0]
    for name, value in content.items() if isinstance(content, dict) else ():
        key = f"{before}.{name}" if before else name
        yield key
        yield from _keys(value, key)


def _column(chunk: str, key: str) -> int:
    """Return the column of a key in its first line, searching for the longest suffix of the key."""
    first, names = chunk.partition("\n")[0], key.split(".")
    for start in range(len(names)):
        name = ".".join(names[start:])
        match = re.search(rf"(?<![\w-])[\"']?{re.escape(name)}[\"']?(?![\w-])", first)
        if match:
            return match.start() + 1
    return len(first) - len(first.lstrip()) + 1
