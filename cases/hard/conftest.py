"""Collection of the files of this folder as tests: `pytest cases/hard` tries the first case of each."""

from reflowshock.cases.hard.collector import pytest_addoption, pytest_collect_file  # noqa: F401
from reflowshock.workflow.process.kernel_folder import choose_kernel_folder

choose_kernel_folder()
