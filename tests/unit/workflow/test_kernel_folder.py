"""The folder of compiled kernels, and what compiling takes."""

from pathlib import Path

import pytest

from reflowshock.kernel_cache import source_cache
from reflowshock.workflow.process import kernel_folder


def test_folder_of_the_user_stays(tmp_path: Path) -> None:
    environment = {"XDG_CACHE_HOME": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "mine")}
    kernel_folder.choose_kernel_folder(environment)
    assert environment["NUMBA_CACHE_DIR"] == str(tmp_path / "mine")


def test_folder_is_made(tmp_path: Path) -> None:
    environment = {"XDG_CACHE_HOME": str(tmp_path)}
    kernel_folder.choose_kernel_folder(environment)
    assert Path(environment["NUMBA_CACHE_DIR"]).parent == tmp_path / "reflowshock"


@pytest.mark.parametrize("variable", ["XDG_CACHE_HOME", "NUMBA_CACHE_DIR"])
def test_where_none_can_be_made_it_is_temporary(tmp_path: Path, monkeypatch, variable: str) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    environment = {"HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "file"), variable: str(tmp_path / "file")}
    kernel_folder.choose_kernel_folder(environment)
    folder = Path(environment["NUMBA_CACHE_DIR"])
    assert folder.is_dir()
    assert folder.parent == tmp_path


def test_compilation_is_predicted_until_it_was_done(tmp_path: Path) -> None:
    environment = {"NUMBA_CACHE_DIR": str(tmp_path)}
    once = kernel_folder.compilation_time(["geometry", "shock"], environment)
    assert kernel_folder.compilation_time(["reflow", "shock"], environment) > once > 0.0
    assert kernel_folder.compilation_time(["geometry"], environment) == 0.0
    assert kernel_folder.compilation_time(["shock"], {"XDG_CACHE_HOME": str(tmp_path / "none")}) == once
    others = tmp_path / source_cache(tmp_path).parts[-2] / "other_sources"
    for folder, seconds in ((others, once), (source_cache(tmp_path), 0.0)):
        (folder / "kernels_1").mkdir(parents=True)
        (folder / "kernels_1" / "levels.take_steps-173.py311.nbi").write_bytes(b"")
        assert kernel_folder.compilation_time(["shock"], environment) == seconds


def test_kernels_that_tell_of_compilation_exist() -> None:
    from reflowshock.fem.kernels import levels
    from reflowshock.particles.core import neighbours

    named = {kernel for kernel, _ in kernel_folder.KERNELS.values()}
    modules = {"levels": levels, "neighbours": neighbours}
    assert all(hasattr(modules[name.partition(".")[0]], name.partition(".")[2]) for name in named)
