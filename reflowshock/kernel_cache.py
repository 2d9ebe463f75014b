"""Numba cache locator that indexes compiled kernels by module and by a digest of all kernel sources.

Numba checks only the file of a kernel, not the files of the functions that it inlines, so an update could leave stale
machine code in use. It also indexes kernels by path, so a second checkout of the same sources would compile them all
again. The packages with kernels call ``install_locator``; kernels of other programs are not affected. The folder of the
cache is chosen in ``workflow/process/kernel_folder.py``.
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
CACHING_MODULE = "numba.core.caching"
ROOT = Path(__file__).parent
PACKAGES = ("fem", "materials", "particles")  # packages whose functions are compiled
KERNEL_MODULES = tuple(f"{__package__}.{name}." for name in PACKAGES)


def install_locator() -> None:
    """Let Numba index the compiled kernels of this program by module and source digest instead of by path.

    It takes effect now or when Numba is loaded; further calls change nothing.
    """
    if CACHING_MODULE in sys.modules:
        _insert_locator(sys.modules[CACHING_MODULE])
    elif not any(isinstance(finder, _ImportHook) for finder in sys.meta_path):
        sys.meta_path.insert(0, _ImportHook())


class ModuleCacheLocator:
    """Cache locator for the kernels of this program, with the interface of Numba's own locators."""

    def __init__(self, function: Callable, file: str) -> None:
        """Store a kernel and the path of its source file."""
        self._function, self._py_file = function, file  # Numba reads this name in its error messages

    @classmethod
    def from_function(cls, function: Callable, file: str) -> "ModuleCacheLocator | None":
        """Return the locator of a kernel, or None for kernels of other programs or without a writable folder."""
        if VARIABLE not in os.environ or not function.__module__.startswith(KERNEL_MODULES):
            return None
        locator = cls(function, file)
        return locator if _is_ready(locator.get_cache_path()) else None

    def get_cache_path(self) -> str:
        """Return the folder of the compiled kernel."""
        return str(source_cache(Path(os.environ[VARIABLE])) / self._function.__module__)

    def ensure_cache_path(self) -> None:
        """Create the folder of the compiled kernel."""
        Path(self.get_cache_path()).mkdir(parents=True, exist_ok=True)

    def get_source_stamp(self) -> str:
        """Return the digest of all kernel sources, which Numba compares to detect changes."""
        return digest()

    def get_disambiguator(self) -> str:
        """Return the line number, which separates kernels of the same name in one file."""
        return str(inspect.unwrap(self._function).__code__.co_firstlineno)


class _ImportHook:
    """Import hook that inserts the locator as soon as Numba's caching module is loaded."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Return the spec of Numba's caching module with a loader that inserts the locator; None for other modules."""
        if name != CACHING_MODULE:
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_insert(module: ModuleType) -> None:
                execute(module)
                _insert_locator(module)

            spec.loader.exec_module = execute_and_insert  # type: ignore[method-assign]
        return spec


def _insert_locator(caching: ModuleType) -> None:
    cache_type = getattr(caching, "CacheImpl", None) or caching._CacheImpl  # renamed in recent versions
    classes = cache_type._locator_classes
    if _has_locator_classes(_compiler()) and ModuleCacheLocator not in classes:
        classes.insert(0, ModuleCacheLocator)


def source_cache(folder: Path) -> Path:
    """Return the subfolder of a kernel cache for the present sources and version of Numba; the folder is not created.

    Versions of Numba without locators that can be replaced use ``folder`` itself.

    Args:
        folder: Folder with the compiled kernels of all versions.
    """
    version = _compiler()
    return folder / f"numba-{version}" / digest() if _has_locator_classes(version) else folder


@cache
def digest() -> str:
    """Return a digest of the sources of all packages with kernels, 12 hexadecimal digits."""
    return digest_of_sources(*(ROOT / name for name in PACKAGES)).hex()[:12]


@cache
def _compiler() -> str:
    from importlib.metadata import version

    return version("numba")


def _has_locator_classes(version: str) -> bool:
    """Return whether this version of Numba accepts additional locator classes (0.62 and later)."""
    return tuple(int(part) for part in version.split(".")[:2]) >= (0, 62)


@cache
def _is_ready(folder: str) -> bool:
    return ensure_writable(Path(folder))


def ensure_writable(folder: Path) -> bool:
    """Create a folder if necessary and return whether files can be written in it; errors give False."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
