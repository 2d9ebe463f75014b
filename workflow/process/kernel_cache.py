"""Where compiled kernels are kept: a folder that belongs to the sources they were made from.

Numba looks at the file of a kernel alone, and not at the files of those that it calls: after an update it would go on
with machine code that holds the old ones.
"""

import hashlib
import os
import tempfile
from collections.abc import Iterable, Mapping, MutableMapping
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("reflowshock.fem", "reflowshock.particles")  # those with kernels
VARIABLE = "NUMBA_CACHE_DIR"
# Stage -> one of the kernels that it compiles, and the processor seconds that it takes to compile all of them, as on
# jedec_bga; a stage of the same name in another kind of case takes no more.
KERNELS = {"reflow": ("neighbours._rows", 24.0), "shock": ("levels.take_steps", 48.0)}


def keep_kernels_by_source(environment: MutableMapping[str, str] = os.environ) -> None:
    """Name the folder to Numba, which must not be loaded yet, and to all processes that this one starts.

    A folder that the user has named stays, if it can be written to. Where none can be made, it is a temporary one.
    """
    named = environment.get(VARIABLE)
    if named and _is_made(Path(named)):
        return
    folder = _usual_folder(environment)
    if folder and _is_made(folder):
        environment[VARIABLE] = str(folder)
        return
    environment[VARIABLE] = tempfile.mkdtemp(prefix="reflowshock-kernels-")


def compilation(stages: Iterable[str], environment: Mapping[str, str] = os.environ) -> float:
    """Predict for how long [s] stages will compile kernels: not at all where a run by these sources has done it."""
    named = environment.get(VARIABLE)
    folder = Path(named) if named else _usual_folder(environment)
    kept = {path.name.rpartition("-")[0] for path in folder.rglob("*.nbi")} if folder else set()
    return sum(seconds for stage, (kernel, seconds) in KERNELS.items() if stage in stages and kernel not in kept)


def _usual_folder(environment: Mapping[str, str]) -> Path | None:
    """Return the folder of the present sources; None where the user has no home."""
    with suppress(RuntimeError):
        home = environment.get("HOME") or Path.home()
        return Path(environment.get("XDG_CACHE_HOME") or Path(home, ".cache")) / "reflowshock" / f"kernels-{digest()}"
    return None


def _is_made(folder: Path) -> bool:
    """Return whether a folder is there, or made now, in which files can be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


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
