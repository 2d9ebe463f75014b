"""Where Numba keeps a compiled kernel: by its module and the sources of all packages with kernels.

Numba looks at the file of a kernel alone, and not at the files of those that it calls: after an update it would go on
with machine code that holds the old ones. And it looks at where that file is: another checkout, or an installation, of
the same sources would compile them all again. The packages with kernels call `ask_first`; other processes, of other
programs too, are told nothing.
"""

import inspect
import os
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from reflowshock.sources import digest_of_sources

VARIABLE = "NUMBA_CACHE_DIR"
CACHING = "numba.core.caching"
ROOT = Path(__file__).parent
PACKAGES = ("fem", "materials", "particles")  # packages whose functions are compiled
OWN = tuple(f"{__package__}.{name}." for name in PACKAGES)


def ask_first() -> None:
    """Let Numba ask `PlaceByModule` before its own classes, from when it is loaded; twice is as once."""
    if CACHING in sys.modules:
        _put_first(sys.modules[CACHING])
    elif not any(isinstance(finder, _Loading) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Loading())


class PlaceByModule:
    """Where Numba keeps a kernel of this program, wherever its source is: what Numba asks a cache locator for."""

    def __init__(self, function: Callable, file: str) -> None:
        """Take a kernel and its source."""
        self._function, self._py_file = function, file  # by this name Numba tells which one cannot be kept

    @classmethod
    def from_function(cls, function: Callable, file: str) -> "PlaceByModule | None":
        """Return the place of a kernel; None where it is not one of this program, or its folder cannot be made."""
        if VARIABLE not in os.environ or not function.__module__.startswith(OWN):
            return None
        place = cls(function, file)
        return place if _is_ready(place.get_cache_path()) else None

    def get_cache_path(self) -> str:
        """Return its folder."""
        return str(present(Path(os.environ[VARIABLE])) / self._function.__module__)

    def ensure_cache_path(self) -> None:
        """Make its folder."""
        Path(self.get_cache_path()).mkdir(parents=True, exist_ok=True)

    def get_source_stamp(self) -> str:
        """Return what says that the source is the same, and those of all that it may call."""
        return digest()

    def get_disambiguator(self) -> str:
        """Return what tells kernels of one name in a file apart."""
        return str(inspect.unwrap(self._function).__code__.co_firstlineno)


class _Loading:
    """What Python asks for modules, until it loads the one of Numba that tells where kernels are kept."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Find that one as Python does, to be followed by ours."""
        if name != CACHING:
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_put_first(module: ModuleType) -> None:
                execute(module)
                _put_first(module)

            spec.loader.exec_module = execute_and_put_first  # type: ignore[method-assign]
        return spec


def _put_first(caching: ModuleType) -> None:
    cache_type = getattr(caching, "CacheImpl", None) or caching._CacheImpl  # its name has changed
    classes = cache_type._locator_classes
    if _asks_others(_compiler()) and PlaceByModule not in classes:
        classes.insert(0, PlaceByModule)


def present(folder: Path) -> Path:
    """Return where, in the folder of all kernels, those of the present sources and version of Numba are."""
    version = _compiler()
    return folder / f"numba-{version}" / digest() if _asks_others(version) else folder


@cache
def digest() -> str:
    """Return a name for the present sources of all packages with kernels."""
    return digest_of_sources(*(ROOT / name for name in PACKAGES)).hex()[:12]


@cache
def _compiler() -> str:
    from importlib.metadata import version

    return version("numba")


def _asks_others(version: str) -> bool:
    """Return whether this version of Numba lets others name classes of places: an older one places kernels itself."""
    return tuple(int(part) for part in version.split(".")[:2]) >= (0, 62)


@cache
def _is_ready(folder: str) -> bool:
    return is_made(Path(folder))


def is_made(folder: Path) -> bool:
    """Return whether a folder is there, or made now, in which files can be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
