"""Set-up of all tests: kernel cache, garbage collection, collection and order of the test files, and shared runs.

Kernels are compiled into the same folders as by the command. Tests that change a shared run work on copies of it.
"""

import fcntl
import gc
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from reflowshock.workflow.process.kernel_folder import choose_kernel_folder
from tests.support.compiled_once import collect_garbage_rarely, compile_once
from tests.support.shared_run import shared_run

choose_kernel_folder()
compile_once()
collect_garbage_rarely()
os.environ |= {"OMPI_MCA_mpi_yield_when_idle": "1"}  # workers share the cores: waiting ranks yield

# Two workers begin with the first two: one compiles kernels while the other needs none. Then long files come first, and
# many short files come last, which keep all workers busy to the end.
ORDER = (
    "tests/verification/test_effects.py", "tests/unit/test_code.py", "tests/unit/workflow/", "tests/pipeline/",
    "tests/faults/", "tests/mpi/", "tests/stability/", "cases/hard/", "tests/verification/",
    "tests/",
)  # fmt: skip


@pytest.hookimpl(hookwrapper=True)
def pytest_collection() -> Iterator[None]:
    """Let one worker compile the modules of the tests, while the others wait to load them."""
    with Path(__file__).open() as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            fcntl.flock(lock, fcntl.LOCK_SH)
        yield


def pytest_collection_finish() -> None:
    """Exclude modules and test items from garbage collection."""
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the test files into the order in which workers receive them."""
    items.sort(key=lambda item: next((k for k, begin in enumerate(ORDER) if item.nodeid.startswith(begin)), len(ORDER)))


@pytest.fixture(scope="session")
def first_run(tmp_path_factory, worker_id) -> tuple[Path, subprocess.CompletedProcess]:
    """Return the run folder of the shortened case and its completed process."""
    return shared_run("small", tmp_path_factory, worker_id)


@pytest.fixture
def run_folder(first_run, tmp_path) -> Path:
    """Return a copy of the run folder of the shortened case, with its modification times."""
    return shutil.copytree(first_run[0], tmp_path / "small")


@pytest.fixture
def drop_folder(tmp_path_factory, worker_id, tmp_path) -> Path:
    """Return a copy of the run folder of a drop of 125 particles."""
    folder, ended = shared_run("drop", tmp_path_factory, worker_id)
    assert ended.returncode == 0, ended.stderr
    return shutil.copytree(folder, tmp_path / "run")


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> None:
    """Run loops on one thread: threads of workers that share the cores would cost a tenth of the time."""
    import numba

    numba.set_num_threads(1)


@pytest.fixture
def every_thread():
    """Yield the number of threads; afterwards loops run on one thread again."""
    import numba

    yield numba.config.NUMBA_NUM_THREADS
    numba.set_num_threads(1)
