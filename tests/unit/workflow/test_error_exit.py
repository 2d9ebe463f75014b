"""Whatever ends the program becomes one plain line and an exit code."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from reflowshock.problem import Problem
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.process import error_exit
from reflowshock.workflow.process.error_exit import describe_error, report_error
from reflowshock.workflow.process.launch import LaunchError
from reflowshock.workflow.store.folders import RunFolderBusy


@pytest.fixture(autouse=True)
def no_run_before(monkeypatch):
    """Commands that other tests have called in this process are forgotten."""
    monkeypatch.setattr(error_exit, "_run_folder", {})


COMMAND = "from reflowshock.workflow.__main__ import main; main()"


def raised(error: BaseException, cause: BaseException | None = None) -> BaseException:
    """Return an error with the traceback and the cause of a raised one."""
    try:
        raise error from cause
    except BaseException as caught:
        return caught


@pytest.mark.parametrize(
    "error, words",
    [
        (OSError(errno.ENOSPC, "x", "/a/b"), "no space left on the device while writing /a/b"),
        (OSError(errno.ENOSPC, "x"), "no space left on the device while writing /where"),
        (OSError(errno.EDQUOT, "x"), "the disk quota is used up while writing /where"),
        (OSError(errno.EROFS, "x", "/a"), "the file system is read-only while writing /a"),
        (PermissionError(errno.EACCES, "x", "/a"), "permission denied: /a"),
        (FileNotFoundError(errno.ENOENT, "x", "/a"), "the file or folder does not exist or was removed: /a"),
        (OSError(errno.EMFILE, "x", "/a"), "too many files are open (ulimit -n): /a"),
        (MemoryError(), error_exit.NO_MEMORY),
        (ImportError("libx.so: failed to map segment from shared object"), error_exit.NO_MEMORY),
        (RuntimeError("can't start new thread"), "no further process or thread can be started (ulimit -u)"),
        (OSError("file write failed: errno = 28, error message = 'No space left on device'"), "no space left on the "
         "device while writing /where"),
        (LaunchError("rank 1 has died"), "rank 1 has died"),
        (ValueError("cannot reshape array\nof size 3"), "ValueError: cannot reshape array"),
        (RuntimeError("plain words"), "plain words"),
        (ZeroDivisionError(), "ZeroDivisionError"),
    ],
)  # fmt: skip
def test_words(error, words):
    assert describe_error(error, Path("/where")) == words


def test_the_cause_of_an_error_decides():
    behind = OSError(errno.ENOSPC, "x", "/a")
    assert describe_error(raised(ValueError("cannot write"), behind)) == "no space left on the device while writing /a"


def test_petsc_errors_are_in_words():
    error = type("Error", (RuntimeError,), {"__module__": "petsc4py.PETSc", "ierr": 55})()
    assert describe_error(error) == f"PETSc: {error_exit.NO_MEMORY}"


@pytest.mark.parametrize(
    "error, code, said",
    [
        (CaseError("a.toml", [Problem("k", "is bad")]), 2, "error: a.toml: k: is bad\n"),
        (RunFolderBusy("busy"), 1, "error: busy\n"),
        (KeyboardInterrupt(), 1, "error: interrupted\n"),
        (raised(SystemError("x"), KeyboardInterrupt()), 1, "error: interrupted\n"),
        (BrokenPipeError(errno.EPIPE, "x"), 1, ""),
    ],
)
def test_known_ends_need_no_details(error, code, said, capsys):
    assert report_error(error) == code
    assert capsys.readouterr().err == said


def test_details_go_to_the_logs_of_the_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(error_exit, "_run_folder", {"folder": tmp_path})
    assert report_error(raised(ZeroDivisionError("by zero"))) == 1
    (path,) = (tmp_path / "logs").iterdir()
    assert capsys.readouterr().err == f"error: ZeroDivisionError: by zero (details: {path})\n"
    assert "in raised" in path.read_text(encoding="utf-8")


def test_details_go_to_a_temporary_file_without_a_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    report_error(ZeroDivisionError("by zero"))
    (path,) = tmp_path.iterdir()
    assert f"(details: {path})" in capsys.readouterr().err


def test_the_last_lines_are_printed_if_no_file_can_be_written(monkeypatch, capsys):
    monkeypatch.setattr("tempfile.tempdir", "/proc/nowhere")
    report_error(raised(ZeroDivisionError("by zero")))
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("error: ZeroDivisionError: by zero (details cannot be written")
    assert len(lines) <= 1 + error_exit.LAST_LINES


def command(*arguments: str, **options) -> subprocess.CompletedProcess:
    """Run the test's own command with arguments; return the completed process."""
    heed = ["env", "--default-signal=INT,HUP"]  # ignored in the background of a shell, under nohup
    line = [*heed, sys.executable, "-c", COMMAND, *arguments]
    return subprocess.run(line, capture_output=True, encoding="utf-8", timeout=100, check=False, **options)


def test_an_interrupt_while_the_program_loads_is_one_line(tmp_path):
    (tmp_path / "typer.py").write_text("import os, signal; os.kill(os.getpid(), signal.SIGINT)\n", encoding="utf-8")
    paths = os.pathsep.join([str(tmp_path), *sys.path])
    done = command("schema", env=os.environ | {"PYTHONPATH": paths})
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "error: interrupted\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_in_any_command_are_one_line(tmp_path, number):
    (tmp_path / "sitecustomize.py").write_text(
        "import os; from reflowshock.workflow.pipeline import schema\n"
        f"schema.case_schema = lambda: os.kill(os.getpid(), {int(number)})\n", encoding="utf-8"
    )  # fmt: skip
    paths = os.pathsep.join([str(tmp_path), *sys.path])
    done = command("schema", env=os.environ | {"PYTHONPATH": paths})
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "error: interrupted\n")


def test_a_reader_that_goes_is_not_an_error():
    line = f"{sys.executable} -c '{COMMAND}' schema | head -1"
    done = subprocess.run(["bash", "-c", f"set -o pipefail; {line}"], capture_output=True, check=False, timeout=100)
    assert (done.stdout, done.stderr) == (b"{\n", b"")


def test_a_full_device_is_one_line():
    with open("/dev/full", "w", encoding="utf-8") as full:
        line = [sys.executable, "-c", COMMAND, "schema"]
        done = subprocess.run(line, stdout=full, stderr=subprocess.PIPE, encoding="utf-8", check=False, timeout=100)
    assert done.returncode == 1
    assert done.stderr.startswith("error: no space left on the device")
    assert done.stderr.count("\n") == 1


def test_usage_errors_are_one_line_and_text():
    done = command("plan", "--bad\x1b[31m")
    assert done.returncode == 2
    assert done.stderr.startswith(r"error: No such option: --bad\x1b[31m")
    assert done.stderr.count("\n") == 1
