"""Where compiled kernels are kept: a folder that belongs to the sources they were made from.

Numba looks at the file of a kernel alone, and not at the files of those that it calls: after an update it would go on
with machine code that holds the old ones.
"""

import hashlib
import os
from collections.abc import MutableMapping
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("fem", "particles")  # those with kernels
VARIABLE = "NUMBA_CACHE_DIR"


def keep_kernels_by_source(environment: MutableMapping[str, str] = os.environ) -> None:
    """Name the folder to Numba, which must not be loaded yet, and to all processes that this one starts.

    A folder that the user has named stays. Where none can be made, Numba keeps its own place.
    """
    if VARIABLE in environment:
        return
    cache = Path(environment.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = cache / "reflowshock" / f"kernels-{digest()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    environment[VARIABLE] = str(folder)


def digest() -> str:
    """Return a name for the present sources of all packages with kernels."""
    found = hashlib.sha256()
    for package in PACKAGES:
        spec = find_spec(package)
        for root in (spec.submodule_search_locations if spec else None) or ():
            for path in sorted(Path(root).rglob("*.py")):
                if b"njit" in (text := path.read_bytes()):
                    found.update(text)
    return found.hexdigest()[:12]
