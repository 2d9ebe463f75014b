"""Names that were not meant as they were written."""

import difflib
from collections.abc import Iterable


def nearest(name: str, names: Iterable[str], alike: float = 0.6) -> str:
    """Return the valid name most like a wrong one, in upper or lower case, or an empty string if none is so alike."""
    written = {valid.lower(): valid for valid in names}
    matches = difflib.get_close_matches(name.lower(), list(written), n=1, cutoff=alike)
    return written[matches[0]] if matches else ""
