"""Suggestions for misspelled names."""

import difflib
from collections.abc import Iterable


def find_nearest(name: str, names: Iterable[str], similarity: float = 0.6) -> str:
    """Return the valid name nearest to a wrong one, ignoring case; an empty text if none is similar enough.

    Args:
        name: Wrong name.
        names: Valid names.
        similarity: Required similarity, from 0 to 1 for equal names.
    """
    spellings = {valid.lower(): valid for valid in names}
    matches = difflib.get_close_matches(name.lower(), list(spellings), n=1, cutoff=similarity)
    return spellings[matches[0]] if matches else ""
