"""TOML files of cases and studies: reading, and one-line errors for anything unreadable."""

import os
import stat
import tomllib
from pathlib import Path

from reflowshock.problem import Problem
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.toml_places import Place, place_of_error, toml_fault

MOST_BYTES = 4_000_000
DEEPEST = 16  # nesting depth; no case needs more than five


def read_text(path: Path) -> str:
    """Read the text of a TOML file without its byte order mark.

    Args:
        path: File to read.

    Raises:
        CaseError: The file is missing, not a regular file, too large, or not UTF-8.
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
    """Parse a TOML text.

    Args:
        source: Name of the text in errors.
        text: The text.

    Raises:
        CaseError: The text is not TOML; with line and column.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        position, (key, fault) = place_of_error(error, text), toml_fault(error, text)
        problem = Problem(key, f"is not TOML: {fault}", None, "", "", position.line, position.column)
        raise CaseError(source, [problem]) from error
    except RecursionError:
        raise CaseError(source, [_too_deep()]) from None
    except ValueError as error:  # an integer of thousands of digits, an invalid date
        position = _first_unreadable(text)
        problem = Problem("", f"has a value that cannot be read: {error}", None, "", "", position.line, position.column)
        raise CaseError(source, [problem]) from error
    if is_too_deep(table):
        raise CaseError(source, [_too_deep()])
    return table


def read_toml(path: Path) -> dict:
    """Read a TOML file as nested tables.

    Args:
        path: File to read.

    Raises:
        CaseError: The file is missing, not a regular file, too large, not UTF-8, or not TOML (with line and column).
    """
    return parse_toml(str(path), read_text(path))


def is_too_deep(value: object) -> bool:
    """Return whether tables and lists are nested deeper than ``DEEPEST`` (16) levels.

    Args:
        value: Value of a parsed TOML file: table, list or plain value.
    """
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
    """Return why a path cannot be read as an input file; empty if it can.

    Args:
        path: Path to check.
        most_bytes: Largest allowed size of the file [B].

    Returns:
        Text that says that the path is missing, not a regular file, not readable, or too large.
    """
    try:
        status = path.stat()
    except FileNotFoundError:
        return "does not exist"
    except (OSError, ValueError) as error:  # a loop of links, a name too long, a null character
        return f"cannot be read: {getattr(error, 'strerror', None) or error}"
    if stat.S_ISDIR(status.st_mode):
        return "is a folder, not a file"
    if not stat.S_ISREG(status.st_mode):
        return "is not a regular file"
    if not os.access(path, os.R_OK):
        return "cannot be read: permission denied"
    if status.st_size > most_bytes:
        return f"is too large: {1e-6 * status.st_size:.3g} MB; allowed: up to {1e-6 * most_bytes:g} MB"
    return ""


def resolved_path(folder: Path, name: str) -> str:
    """Return the absolute path of a file that a case names.

    Args:
        folder: Folder of the case file.
        name: Path of the file, relative to this folder or absolute.
    """
    try:
        return str((folder / name).resolve())
    except (OSError, RuntimeError, ValueError):  # a loop of links, a null character: reported later by the gate
        return str(folder / name)


def _too_deep() -> Problem:
    return Problem("", "contains tables or lists nested too deeply", None, f"up to {DEEPEST} levels")


def _first_unreadable(text: str) -> Place:
    """Return the first line with a value that cannot be read, by bisection."""
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
