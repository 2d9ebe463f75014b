"""Environment of the program and its subprocesses: defaults are set, and folders that are too small are reported."""

import os
import resource
import stat
import threading

import pytest

from reflowshock.workflow.process import environment
from reflowshock.workflow.process.environment import (
    EnvironmentProblem,
    check_limits,
    check_ranks,
    complete,
    private_folder,
)


@pytest.fixture
def nowhere(tmp_path):
    """A path that is not a folder and cannot be created."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    return str(tmp_path / "file" / "folder")


def test_places_of_the_user_stay(tmp_path):
    original = {"HOME": str(tmp_path), "TMPDIR": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    found = dict(original)
    complete(found)
    assert {name: found[name] for name in original} == original
    assert found["NUMBA_CACHE_DIR"].startswith(str(tmp_path / "cache"))
    assert not {"XDG_CONFIG_HOME", "XDG_DATA_HOME", "MPLCONFIGDIR"} & set(found)


def test_twice_is_as_once(tmp_path, nowhere):
    variables = {"HOME": nowhere, "TMPDIR": str(tmp_path)}
    complete(variables)
    once = dict(variables)
    complete(variables)
    assert variables == once


def test_a_home_that_is_not_there_is_a_private_temporary_folder(tmp_path, nowhere):
    variables = {"HOME": nowhere, "TMPDIR": str(tmp_path)}
    complete(variables)
    home = tmp_path / f"reflowshock-{os.getuid()}"
    assert variables["HOME"] == str(home)
    assert stat.S_IMODE(home.stat().st_mode) == 0o700
    assert variables["NUMBA_CACHE_DIR"].startswith(str(home))


def test_a_home_that_cannot_be_written_to_stays_but_nothing_is_kept_there(tmp_path):
    variables = {"HOME": "/proc", "TMPDIR": str(tmp_path)}
    complete(variables)
    assert variables["HOME"] == "/proc"
    assert all(
        variables[name].startswith(str(tmp_path)) and os.path.isdir(variables[name])
        for name in environment.USER_FOLDERS
    )


@pytest.mark.parametrize("name", [*environment.USER_FOLDERS, "NUMBA_CACHE_DIR"])
def test_a_named_place_that_cannot_be_written_to_is_another(tmp_path, nowhere, name):
    variables = {"HOME": str(tmp_path), "TMPDIR": str(tmp_path), name: nowhere}
    complete(variables)
    assert variables[name].startswith(str(tmp_path))
    assert variables[name] != nowhere


def test_matplotlib_finds_its_own_place(tmp_path, nowhere):
    variables = {"HOME": str(tmp_path), "TMPDIR": str(tmp_path), "MPLCONFIGDIR": nowhere}
    complete(variables)
    assert "MPLCONFIGDIR" not in variables


def test_temporary_files_go_where_they_can(tmp_path, nowhere, monkeypatch):
    monkeypatch.setattr(environment, "TEMPORARY", (nowhere, str(tmp_path)))
    variables = {"HOME": str(tmp_path), "TMPDIR": nowhere}
    complete(variables)
    assert variables["TMPDIR"] == str(tmp_path)


def test_missing_write_access_is_reported(nowhere, monkeypatch):
    monkeypatch.setattr(environment, "TEMPORARY", (nowhere,))
    with pytest.raises(EnvironmentProblem, match=r"no folder for temporary files can be written to; tried: .*folder"):
        complete({"TMPDIR": nowhere})


def test_a_folder_that_somebody_else_has_made_is_not_trusted(tmp_path):
    trap = tmp_path / f"reflowshock-{os.getuid()}"
    trap.symlink_to(tmp_path)
    assert private_folder(tmp_path) != trap
    trap.unlink()
    trap.mkdir()
    trap.chmod(0o777)
    assert private_folder(tmp_path) != trap


def test_what_a_job_of_mpi_left_is_removed(tmp_path):
    variables = {
        "HOME": str(tmp_path), "OMPI_COMM_WORLD_SIZE": "1", "PMIX_RANK": "0", "OMPI_MCA_ess": "x", "PMI_RANK": "0",
        "OMPI_MCA_btl": "self", "PMIX_MCA_gds": "hash",
    }  # fmt: skip
    complete(variables)
    assert {name for name in variables if name.startswith(("OMPI", "PMI"))} == {"OMPI_MCA_btl", "PMIX_MCA_gds"}


def test_several_ranks_are_refused_by_the_first():
    for rank in "01":
        with pytest.raises(
            EnvironmentProblem, match="started on 2 MPI ranks; start it without mpirun, it starts its own"
        ) as raised:
            check_ranks({"OMPI_COMM_WORLD_SIZE": "2", "OMPI_COMM_WORLD_RANK": rank})
        assert (raised.value.exit_code, raised.value.silent) == (2, rank == "1")
    check_ranks({"OMPI_COMM_WORLD_SIZE": "1"})


@pytest.mark.parametrize(
    "number, soft, words",
    [
        (resource.RLIMIT_AS, 3e8, r"only 300 MB of memory may be used \(ulimit -v\), 2000 MB are needed"),
        (resource.RLIMIT_FSIZE, 8192, r"only files of 0.00819 MB may be written \(ulimit -f\), 16 MB are needed"),
        (resource.RLIMIT_NOFILE, 16, r"only 16 files may be open \(ulimit -n\), at least 64 are needed"),
    ],
)
def test_too_small_limits_of_the_shell_are_reported(monkeypatch, number, soft, words):
    real = resource.getrlimit
    monkeypatch.setattr(resource, "getrlimit", lambda one: (int(soft), int(soft)) if one == number else real(one))
    monkeypatch.setattr(resource, "setrlimit", lambda one, limits: None)
    with pytest.raises(EnvironmentProblem, match=words):
        check_limits()


def test_more_files_are_asked_for(monkeypatch):
    asked = []
    monkeypatch.setattr(resource, "getrlimit", lambda one: (32, 100_000))
    monkeypatch.setattr(resource, "setrlimit", lambda one, limits: asked.append((one, limits)))
    monkeypatch.setattr(environment, "MINIMUM_LIMITS", ())
    check_limits()
    assert asked == [(resource.RLIMIT_NOFILE, (environment.TARGET_FILES, 100_000))]


def test_threads_that_cannot_start_are_reported(monkeypatch):
    def refuse(self):
        raise RuntimeError("can't start new thread")

    real = resource.getrlimit
    limits = {resource.RLIMIT_NPROC: (12, 12)}
    monkeypatch.setattr(resource, "getrlimit", lambda one: limits.get(one, real(one)))
    check_limits()
    monkeypatch.setattr(threading.Thread, "start", refuse)
    with pytest.raises(EnvironmentProblem, match=r"cannot be started \(ulimit -u 12\)"):
        check_limits()
