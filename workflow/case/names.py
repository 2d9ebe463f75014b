"""Names of cases, scales, studies, layers and loads, which become file names and parts of keys."""

import re
from typing import Annotated

from pydantic import Field

from reflowshock.problem import Problem

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$"
NAMES = "letters, digits, _ . -, starting with a letter or digit, at most 64 characters"
_NAME = re.compile(NAME[1:-1])  # matched in full: $ would let a newline pass at the end
Name = Annotated[str, Field(pattern=NAME)]


def is_name(text: object) -> bool:
    """Return whether a value is a valid name of a case or a user-defined table.

    Valid names have up to 64 letters, digits, ``_``, ``.`` or ``-`` and start with a letter or digit.
    """
    return isinstance(text, str) and _NAME.fullmatch(text) is not None


def wrong_name(key: str, text: object) -> Problem:
    """Return the problem that reports an invalid name.

    Args:
        key: Dotted key of the table that contains the name.
        text: The invalid name.
    """
    return Problem(key, "is not a valid name", text, NAMES)
