"""Compiled kernels belong to the sources that they were made from, wherever these are, and to this program alone."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from reflowshock import kernel_cache

ASKED = """
from reflowshock.particles.core.neighbours import write_near
print(write_near._cache.cache_path)
"""


def test_digest_changes_with_any_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A constant that is frozen into a kernel is in a file without kernels, as `compiled` kernels do not say njit."""
    monkeypatch.setattr(kernel_cache, "ROOT", tmp_path)
    (tmp_path / "fem").mkdir()
    (tmp_path / "materials").mkdir()
    source = tmp_path / "particles" / "sph" / "constants.py"
    source.parent.mkdir(parents=True)
    digests = []
    for text in ("REPRODUCING = 2\n", "REPRODUCING = 3\n"):
        source.write_text(text)
        kernel_cache.digest.cache_clear()
        digests.append(kernel_cache.digest())
    kernel_cache.digest.cache_clear()
    assert digests[0] != digests[1]


def test_tests_use_it() -> None:
    from reflowshock.particles.core.neighbours import write_near

    assert kernel_cache.VARIABLE in os.environ
    locator = kernel_cache.ModuleCacheLocator(write_near.py_func, __file__)
    assert write_near._cache.cache_path == locator.get_cache_path()


def test_a_kernel_is_kept_by_its_module_and_all_sources_wherever_they_are(tmp_path: Path, monkeypatch) -> None:
    def kernel() -> None:
        pass

    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path / "kept"))
    kernel.__module__ = "reflowshock.fem.kernels.some"
    from_function = kernel_cache.ModuleCacheLocator.from_function
    locators = [from_function(kernel, f"{root}/fem/kernels/some.py") for root in ("/a", "/b")]
    assert len({locator.get_cache_path() for locator in locators}) == 1
    assert {locator.get_source_stamp() for locator in locators} == {kernel_cache.digest()}
    kernel.__module__ = "somebody.kernels"
    assert kernel_cache.ModuleCacheLocator.from_function(kernel, "/a/kernels.py") is None


def test_other_sources_have_another_folder(tmp_path: Path, monkeypatch) -> None:
    """Also where the user has named one for all: two checkouts would compile by turns."""
    here = kernel_cache.source_cache(tmp_path)
    monkeypatch.setattr(kernel_cache, "digest", lambda: "other")
    assert kernel_cache.source_cache(tmp_path) != here


def test_an_old_numba_places_kernels_itself(tmp_path: Path, monkeypatch) -> None:
    for version, asks in (("0.56.4", False), ("0.61.2", False), ("0.62.0rc1", True), ("1.0", True)):
        monkeypatch.setattr(kernel_cache, "_compiler", lambda version=version: version)
        assert (kernel_cache.source_cache(tmp_path) != tmp_path) == asks


@pytest.mark.parametrize("first", ["import sys, reflowshock.fem; assert 'numba' not in sys.modules", "import numba"])
def test_numba_asks_it_first_whenever_it_is_loaded(tmp_path: Path, first: str) -> None:
    environment = {**os.environ, kernel_cache.VARIABLE: str(tmp_path)}
    code = first + ASKED
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert Path(done.stdout.strip()).parent == kernel_cache.source_cache(tmp_path)


def test_programs_that_this_one_starts_are_told_no_class() -> None:
    """One of another Python could not load it, and each `njit(cache=True)` of its would fail."""
    from reflowshock.workflow.process.environment import complete

    environment = {"HOME": os.environ["HOME"]}
    complete(environment)
    assert "NUMBA_CACHE_LOCATOR_CLASSES" not in environment
