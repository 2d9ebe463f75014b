"""Before any test is loaded: compiled kernels belong to their sources, as in the command. Then: runs that tests share.

Tests that change a shared run work on copies of it.
"""

import shutil
import subprocess
from pathlib import Path

import pytest

from reflowshock.workflow.process.kernel_cache import keep_kernels_by_source
from tests.support.shared_run import shared_run

keep_kernels_by_source()


@pytest.fixture(scope="session")
def first_run(tmp_path_factory, worker_id) -> tuple[Path, subprocess.CompletedProcess]:
    """The run folder of the shortened case, and how its run ended."""
    return shared_run("small", tmp_path_factory, worker_id)


@pytest.fixture
def run_folder(first_run, tmp_path) -> Path:
    """A copy of the run folder of the shortened case, with its modification times."""
    return shutil.copytree(first_run[0], tmp_path / "small")


@pytest.fixture
def drop_folder(tmp_path_factory, worker_id, tmp_path) -> Path:
    """A copy of the run folder of a drop of 125 particles."""
    folder, ended = shared_run("drop", tmp_path_factory, worker_id)
    assert ended.returncode == 0, ended.stderr
    return shutil.copytree(folder, tmp_path / "run")
