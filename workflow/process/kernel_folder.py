"""Folder of compiled kernels, which is passed to Numba in an environment variable, and predicted compilation time.

``reflowshock/kernel_cache.py`` arranges the kernels inside this folder.
"""

import os
import tempfile
from collections.abc import Iterable, Mapping, MutableMapping
from contextlib import suppress
from pathlib import Path

from reflowshock.kernel_cache import VARIABLE, digest, ensure_writable, source_cache

# Stage -> one of its kernels, and the CPU time for compiling all of them in jedec_bga, an upper bound for other cases.
KERNELS = {"reflow": ("neighbours._compressed_rows", 24.0), "shock": ("levels.take_steps", 48.0)}


def choose_kernel_folder(environment: MutableMapping[str, str] = os.environ) -> None:
    """Set the folder of compiled kernels for this process and its children, before Numba is loaded.

    A writable folder chosen by the user stays. If no folder can be created, a temporary one is used.

    Args:
        environment: Variables by name, changed in place.
    """
    named = environment.get(VARIABLE)
    if named and ensure_writable(Path(named)):
        return
    folder = _default_folder(environment)
    if folder and ensure_writable(folder):
        environment[VARIABLE] = str(folder)
        return
    environment[VARIABLE] = tempfile.mkdtemp(prefix="reflowshock-kernels-")


def compilation_time(stages: Iterable[str], environment: Mapping[str, str] = os.environ) -> float:
    """Predict the time that stages spend on compiling kernels [s]; zero if the cache contains them.

    Args:
        stages: Names of the stages to run.
        environment: Variables by name, which give the folder of compiled kernels.
    """
    folder = kernel_folder(environment)
    cached = {path.name.rpartition("-")[0] for path in source_cache(folder).rglob("*.nbi")} if folder else set()
    return sum(seconds for stage, (kernel, seconds) in KERNELS.items() if stage in stages and kernel not in cached)


def kernel_folder(environment: Mapping[str, str] = os.environ) -> Path | None:
    """Return the folder of compiled kernels, which need not exist.

    Args:
        environment: Variables by name, which give the folder or the home of the user.

    Returns:
        Path; None if there is neither.
    """
    named = environment.get(VARIABLE)
    return Path(named) if named else _default_folder(environment)


def _default_folder(environment: Mapping[str, str]) -> Path | None:
    """Return the folder for the present sources in the user's cache, or None without a home."""
    with suppress(RuntimeError):
        home = environment.get("HOME") or Path.home()
        return Path(environment.get("XDG_CACHE_HOME") or Path(home, ".cache")) / "reflowshock" / f"kernels-{digest()}"
    return None
