"""Compiled kernels belong to the sources that they were made from."""

import os
from pathlib import Path

import pytest

from reflowshock.workflow.process import kernel_cache


def test_folder_changes_with_a_kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "laws"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "kernels.py").write_text("from numba import njit\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(kernel_cache, "PACKAGES", ("laws",))
    before = kernel_cache.digest()
    (package / "no_kernel.py").write_text("x = 1\n")
    assert kernel_cache.digest() == before
    (package / "kernels.py").write_text("from numba import njit  # changed\n")
    assert kernel_cache.digest() != before


def test_folder_of_the_user_stays(tmp_path: Path) -> None:
    environment = {"XDG_CACHE_HOME": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "mine")}
    kernel_cache.keep_kernels_by_source(environment)
    assert environment["NUMBA_CACHE_DIR"] == str(tmp_path / "mine")
    assert environment[kernel_cache.PLACES_VARIABLE].startswith("reflowshock.workflow.process.kernel_cache.Place")


def test_folder_is_made(tmp_path: Path) -> None:
    environment = {"XDG_CACHE_HOME": str(tmp_path)}
    kernel_cache.keep_kernels_by_source(environment)
    assert Path(environment["NUMBA_CACHE_DIR"]).parent == tmp_path / "reflowshock"


@pytest.mark.parametrize("variable", ["XDG_CACHE_HOME", "NUMBA_CACHE_DIR"])
def test_where_none_can_be_made_it_is_temporary(tmp_path: Path, monkeypatch, variable: str) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    environment = {"HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "file"), variable: str(tmp_path / "file")}
    kernel_cache.keep_kernels_by_source(environment)
    folder = Path(environment["NUMBA_CACHE_DIR"])
    assert folder.is_dir()
    assert folder.parent == tmp_path


def test_tests_use_it() -> None:
    from reflowshock.particles.core.neighbours import visit

    assert kernel_cache.VARIABLE in os.environ
    assert visit._cache.cache_path == kernel_cache.PlaceByModule(visit.py_func, __file__).get_cache_path()


def test_a_kernel_is_kept_by_its_module_and_all_sources_wherever_they_are(tmp_path: Path, monkeypatch) -> None:
    def kernel() -> None:
        pass

    monkeypatch.setenv(kernel_cache.VARIABLE, str(tmp_path / "kept"))
    kernel.__module__ = "reflowshock.fem.kernels.some"
    places = [kernel_cache.PlaceByModule.from_function(kernel, f"{root}/fem/kernels/some.py") for root in ("/a", "/b")]
    assert len({place.get_cache_path() for place in places}) == 1
    assert {place.get_source_stamp() for place in places} == {kernel_cache.digest()}
    kernel.__module__ = "somebody.kernels"
    assert kernel_cache.PlaceByModule.from_function(kernel, "/a/kernels.py") is None


def test_compilation_is_predicted_until_it_was_done(tmp_path: Path) -> None:
    environment = {"NUMBA_CACHE_DIR": str(tmp_path)}
    once = kernel_cache.compilation(["geometry", "shock"], environment)
    assert kernel_cache.compilation(["reflow", "shock"], environment) > once > 0.0
    assert kernel_cache.compilation(["geometry"], environment) == 0.0
    assert kernel_cache.compilation(["shock"], {"XDG_CACHE_HOME": str(tmp_path / "none")}) == once
    (tmp_path / "kernels_1").mkdir()
    (tmp_path / "kernels_1" / "levels.take_steps-173.py311.nbi").write_bytes(b"")
    assert kernel_cache.compilation(["shock"], environment) == 0.0


def test_kernels_that_tell_of_compilation_exist() -> None:
    from reflowshock.fem.kernels import levels
    from reflowshock.particles.core import neighbours

    named = {kernel for kernel, _ in kernel_cache.KERNELS.values()}
    modules = {"levels": levels, "neighbours": neighbours}
    assert all(hasattr(modules[name.partition(".")[0]], name.partition(".")[2]) for name in named)
