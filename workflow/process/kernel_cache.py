"""Where compiled kernels are kept: a folder that belongs to the sources they were made from.

Numba looks at the file of a kernel alone, and not at the files of those that it calls: after an update it would go on
with machine code that holds the old ones. And it looks at where that file is: another checkout, or an installation, of
the same sources would compile them all again.
"""

import hashlib
import inspect
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, MutableMapping
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("reflowshock.fem", "reflowshock.particles")  # those with kernels
VARIABLE = "NUMBA_CACHE_DIR"
PLACES_VARIABLE = "NUMBA_CACHE_LOCATOR_CLASSES"  # old versions of Numba do not look at it
OTHER_PLACES = "UserProvidedCacheLocator,InTreeCacheLocator,UserWideCacheLocator"  # of what is not ours: Numba's own
# Stage -> one of the kernels that it compiles, and the processor seconds that it takes to compile all of them, as on
# jedec_bga; a stage of the same name in another kind of case takes no more.
KERNELS = {"reflow": ("neighbours._rows", 24.0), "shock": ("levels.take_steps", 48.0)}


def keep_kernels_by_source(environment: MutableMapping[str, str] = os.environ) -> None:
    """Name the folder to Numba, which must not be loaded yet, and to all processes that this one starts.

    A folder that the user has named stays, if it can be written to. Where none can be made, it is a temporary one.
    """
    environment.setdefault(PLACES_VARIABLE, f"{__name__}.{PlaceByModule.__name__},{OTHER_PLACES}")
    named = environment.get(VARIABLE)
    if named and _is_made(Path(named)):
        return
    folder = _usual_folder(environment)
    if folder and _is_made(folder):
        environment[VARIABLE] = str(folder)
        return
    environment[VARIABLE] = tempfile.mkdtemp(prefix="reflowshock-kernels-")


class PlaceByModule:
    """Where Numba keeps a kernel of this program, wherever its source is: what Numba asks a cache locator for."""

    def __init__(self, function: Callable, file: str) -> None:
        """Take a kernel and its source."""
        self._function, self._py_file = function, file  # by this name Numba tells which one cannot be kept

    @classmethod
    def from_function(cls, function: Callable, file: str) -> "PlaceByModule | None":
        """Return the place of a kernel; None where it is not one of this program, or its folder cannot be made."""
        if VARIABLE not in os.environ or not function.__module__.startswith(PACKAGES):
            return None
        place = cls(function, file)
        return place if _is_ready(place.get_cache_path()) else None

    def get_cache_path(self) -> str:
        """Return its folder."""
        return f"{os.environ[VARIABLE]}/{_compiler()}/{self._function.__module__}"

    def ensure_cache_path(self) -> None:
        """Make its folder."""
        Path(self.get_cache_path()).mkdir(parents=True, exist_ok=True)

    def get_source_stamp(self) -> str:
        """Return what says that the source is the same, and those of all that it may call."""
        return _sources()

    def get_disambiguator(self) -> str:
        """Return what tells kernels of one name in a file apart."""
        return str(inspect.unwrap(self._function).__code__.co_firstlineno)


@cache
def _is_ready(folder: str) -> bool:
    return _is_made(Path(folder))


@cache
def _compiler() -> str:
    return f"numba-{version('numba')}"


@cache
def _sources() -> str:
    return digest()


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
