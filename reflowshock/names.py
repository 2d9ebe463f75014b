"""Suggestions for misspelled names."""

import difflib
from collections.abc import Iterable


def nearest(name: str, names: Iterable[str], alike: float = 0.6) -> str:
    """Return the valid name nearest to a wrong one, ignoring case, or an empty string below similarity ``alike``."""
    written = {valid.lower(): valid for valid in names}
    matches = difflib.get_close_matches(name.lower(), list(written), n=1, cutoff=alike)
    return written[matches[0]] if matches else ""
