"""Where keys stand in a TOML file: the standard library tells no positions of what it has read."""

import re
import time
import tomllib
from ast import literal_eval
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

MOST_SECONDS = 1.0  # without a position a message is still right
NAMES = re.compile(r"\(['\"].*\)")  # of a table, as the parser shows them
INLINE = "Duplicate inline table key "
AT = re.compile(r"\(at line (\d+), column (\d+)\)$")


@dataclass(frozen=True, slots=True)
class Place:
    """Line and column in a file, both from 1 on."""

    line: int
    column: int


def place_of_error(error: tomllib.TOMLDecodeError, text: str) -> Place:
    """Return where a text is not TOML; its end where the error says so."""
    found = AT.search(str(error))
    return Place(int(found[1]), int(found[2])) if found else Place(text.count("\n") + 1, 1)


def toml_fault(error: tomllib.TOMLDecodeError, text: str) -> tuple[str, str]:
    """Return of which key a text is not TOML, or an empty string, and what is wrong; without the place."""
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
    """Return the first key that a line gives, or an empty string."""
    with suppress(ValueError, RecursionError):
        return next(_keys(tomllib.loads(line), ""), "")
    return ""


class Places:
    """The places of all keys of a TOML text that can be read.

    Every table's head and every line "key = value" is TOML by itself: lines are taken together until they can be read.
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
        """Return the place of a dotted key, or of the table nearest around it; None where that is the whole file."""
        while key:
            if key in self._places:
                return self._places[key]
            key = key.rpartition(".")[0]
        return None


def _expressions(text: str) -> Iterator[tuple[int, str, dict]]:
    """Yield first line, text and content of each head of a table or key with its value."""
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
    """Yield the dotted keys in a table, each after those around it."""
    while isinstance(content, list) and len(content) == 1:  # the head of a list of tables
        content = content[0]
    for name, value in content.items() if isinstance(content, dict) else ():
        key = f"{before}.{name}" if before else name
        yield key
        yield from _keys(value, key)


def _column(chunk: str, key: str) -> int:
    """Return the column of a key in the first line of the text that gives it: of as much of its end as stands there."""
    first, names = chunk.partition("\n")[0], key.split(".")
    for start in range(len(names)):
        name = ".".join(names[start:])
        found = re.search(rf"(?<![\w-])[\"']?{re.escape(name)}[\"']?(?![\w-])", first)
        if found:
            return found.start() + 1
    return len(first) - len(first.lstrip()) + 1
