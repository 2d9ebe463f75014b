"""Reading TOML files: cases and studies. Whatever a path leads to, it is read quickly or refused in one line."""

import os
import stat
import tomllib
from pathlib import Path

from reflowshock.problem import Problem
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.toml_places import Place, place_of_error, toml_fault

MOST_BYTES = 4_000_000
DEEPEST = 16  # tables in tables; no case has more than five


def read_text(path: Path) -> str:
    """Read the text of a TOML file, a byte order mark left out.

    Raises:
        CaseError: there is no such file, it is none, too large, or not UTF-8.
    """
    fault = fault_of(path, MOST_BYTES)
    if fault:
        raise CaseError(str(path), [Problem("", fault)])
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise CaseError(str(path), [Problem("", f"cannot be read: {error.strerror or error}")]) from error
    except UnicodeDecodeError as error:
        line = path.read_bytes()[: error.start].count(b"\n") + 1
        raise CaseError(str(path), [Problem("", "is not UTF-8 text", line=line, column=1)]) from error


def parse_toml(source: str, text: str) -> dict:
    """Read a TOML text.

    Args:
        source: what errors call it.
        text: the text.

    Raises:
        CaseError: it is not TOML; with line and column.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place, (key, fault) = place_of_error(error, text), toml_fault(error, text)
        problem = Problem(key, f"is not TOML: {fault}", None, "", "", place.line, place.column)
        raise CaseError(source, [problem]) from error
    except RecursionError:
        raise CaseError(source, [_too_deep()]) from None
    except ValueError as error:  # a whole number of thousands of digits, a date that is none
        place = _first_unreadable(text)
        problem = Problem("", f"has a value that cannot be read: {error}", None, "", "", place.line, place.column)
        raise CaseError(source, [problem]) from error
    if is_too_deep(table):
        raise CaseError(source, [_too_deep()])
    return table


def read_toml(path: Path) -> dict:
    """Read a TOML file; errors as ``read_text`` and ``parse_toml``."""
    return parse_toml(str(path), read_text(path))


def is_too_deep(value: object) -> bool:
    """Whether tables and lists are nested deeper than any case needs."""
    level = [value]
    for _ in range(DEEPEST):
        level = [
            item
            for outer in level
            if isinstance(outer, dict | list)
            for item in (outer.values() if isinstance(outer, dict) else outer)
        ]
        if not level:
            return False
    return True


def fault_of(path: Path, most_bytes: int) -> str:
    """Say why a path cannot be read as a file of at most so many bytes; empty where it can. Opens nothing."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return "does not exist"
    except (OSError, ValueError) as error:  # a loop of links, a name too long, a null character
        return f"cannot be read: {getattr(error, 'strerror', None) or error}"
    if stat.S_ISDIR(found.st_mode):
        return "is a folder, not a file"
    if not stat.S_ISREG(found.st_mode):
        return "is not a regular file"
    if not os.access(path, os.R_OK):
        return "cannot be read: permission denied"
    if found.st_size > most_bytes:
        return f"is too large: {1e-6 * found.st_size:.3g} MB; allowed: up to {1e-6 * most_bytes:g} MB"
    return ""


def beside(folder: Path, name: str) -> str:
    """Return the path of a file that a case names, relative to the folder of the case."""
    try:
        return str((folder / name).resolve())
    except (OSError, RuntimeError, ValueError):  # a loop of links, a null character: the gate says what is wrong
        return str(folder / name)


def _too_deep() -> Problem:
    return Problem("", "contains tables or lists nested too deeply", None, f"up to {DEEPEST} levels")


def _first_unreadable(text: str) -> Place:
    """Return the first line at which a text stops being readable for another reason than that it ends there."""
    lines = text.split("\n")
    low, high = 0, len(lines)
    while high - low > 1:
        middle = (low + high) // 2
        try:
            tomllib.loads("\n".join(lines[:middle]))
        except tomllib.TOMLDecodeError:
            low = middle
        except ValueError:
            high = middle
        else:
            low = middle
    return Place(high, 1)
