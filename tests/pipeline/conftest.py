"""One shortened run of the whole pipeline, shared by all tests; tests that change it work on copies."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.workflow_command import reflowshock


@pytest.fixture(scope="session")
def first_run(tmp_path_factory) -> tuple[Path, subprocess.CompletedProcess]:
    """The run folder of the shortened case, and how its run ended."""
    folder = tmp_path_factory.mktemp("runs") / "small"
    return folder, reflowshock("run", folder)


@pytest.fixture
def run_folder(first_run, tmp_path) -> Path:
    """A copy of the run folder, with its modification times."""
    return shutil.copytree(first_run[0], tmp_path / "small")
