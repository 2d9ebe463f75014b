"""Files of this folder are tests: `pytest cases/hard` tries the first case of each."""

from reflowshock.cases.hard.collector import pytest_addoption, pytest_collect_file  # noqa: F401
