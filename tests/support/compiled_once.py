"""Kernel compilation by the first process that needs a kernel; the others wait and load it from the cache.

Workers and ranks that start together need the same kernels; without this each would compile all of them.
"""

import fcntl
import gc
import os
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_held: Counter[Path] = Counter()


def compile_once() -> None:
    """Let this process and its forks look for a cached kernel again after another process has compiled it.

    A kernel waits only for kernels that it calls, and these do not call it: waiting processes cannot form a circle.
    """
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.dispatcher import Dispatcher

    compile_alone = Dispatcher.compile
    if compile_alone.__module__ == __name__:
        return

    def compile_kernel(self, signature):
        folder = self._cache.cache_path
        if folder is None:
            return compile_alone(self, signature)
        name = f"{self.py_func.__module__}.{self.py_func.__qualname__}.lock"
        with global_compiler_lock, _alone(Path(folder, name)):
            return compile_alone(self, signature)

    Dispatcher.compile = compile_kernel


def collect_garbage_rarely() -> None:
    """Collect garbage after more allocations, also in forks of this process, since compilation leaves little of it."""
    gc.set_threshold(20_000, 20, 20)


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold a lock exclusively, once for nested requests."""
    _held[path] += 1
    path.parent.mkdir(parents=True, exist_ok=True)
    lock = os.open(path, os.O_RDWR | os.O_CREAT)
    try:
        if _held[path] == 1:
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)
        _held[path] -= 1
