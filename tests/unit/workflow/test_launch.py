"""Launching programs: their words, their errors, and that nothing stays behind."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

from reflowshock.workflow.process.launch import QUIET, UNBOUND, LaunchError, launch, mpi_command


def test_mpi_command(monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert mpi_command(2, ["program"], oversubscribe=False) == ["mpirun", *UNBOUND, *QUIET, "-n", "2", "program"]
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert mpi_command(3, ["program"], oversubscribe=True) == [
        "mpirun", *UNBOUND, *QUIET, "-n", "3", "--allow-run-as-root", "--oversubscribe", "program",
    ]  # fmt: skip


def test_lines_are_passed_on_as_they_come(tmp_path):
    lines: list[str] = []
    launch([sys.executable, "-c", "print('a'); print('b')"], lines.append, tmp_path / "log.txt")
    assert lines == ["a", "b"]


def test_threads_are_one(tmp_path):
    lines: list[str] = []
    program = "import os; print(os.environ['OMP_NUM_THREADS'])"
    launch([sys.executable, "-c", program], lines.append, tmp_path / "log.txt")
    assert lines == ["1"]


def test_the_last_words_of_a_failure_are_kept(tmp_path):
    with pytest.raises(LaunchError, match="exit code 3: no equilibrium at step 7"):
        launch(
            [sys.executable, "-c", "import sys; print('no equilibrium at step 7', file=sys.stderr); sys.exit(3)"],
            print,
            tmp_path / "log.txt",
        )


def test_the_error_message_of_a_program_is_reported_alone(tmp_path):
    program = "import sys; sys.exit('error: no equilibrium at step 7')"
    with pytest.raises(LaunchError, match=r"^no equilibrium at step 7$"):
        launch([sys.executable, "-c", program], print, tmp_path / "log.txt")


def test_all_lines_of_an_error_message_are_reported(tmp_path):
    lines = ["a warning", "error: rank 1: ", *(f"line {k}" for k in range(30)), "broken; last checkpoint: folder"]
    program = f"import sys; sys.exit({chr(10).join(lines)!r})"
    with pytest.raises(LaunchError, match=r"(?s)^rank 1: .*line 0\n.*; last checkpoint: folder$"):
        launch([sys.executable, "-c", program], print, tmp_path / "log.txt")


@pytest.mark.parametrize(
    "raising, words",
    [
        ("ValueError('cannot reshape')", "ValueError: cannot reshape"),
        ("OSError(28, 'No space left on device')", "no space left on the device"),
    ],
)
def test_a_traceback_stays_in_the_log(tmp_path, raising, words):
    log = tmp_path / "log.txt"
    program = (
        f"import sys, traceback\ntry:\n  raise {raising}\nexcept Exception:\n  text = traceback.format_exc().strip()"
    )
    program += "\nsys.exit(f'error: rank 1: \\n{text}; last checkpoint: folder (window 3)')"
    with pytest.raises(LaunchError) as failed:
        launch([sys.executable, "-c", program], print, log)
    assert str(failed.value) == f"rank 1: {words}; last checkpoint: folder (window 3) (details: {log})"
    assert "Traceback" in log.read_text(encoding="utf-8")


def test_an_exception_of_a_program_is_reported_without_traceback(tmp_path):
    log = tmp_path / "log.txt"
    with pytest.raises(LaunchError, match=r"exit code 1: ModuleNotFoundError: .* 'nothing' \(details: .*\)$"):
        launch([sys.executable, "-c", "import nothing"], print, log)


@pytest.mark.parametrize("number, words", [("SIGXFSZ", "ulimit -f"), ("SIGSEGV", "segmentation fault")])
def test_a_program_that_the_system_ends(tmp_path, number, words):
    program = (
        f"import os, signal; signal.signal(signal.{number}, signal.SIG_DFL); os.kill(os.getpid(), signal.{number})"
    )
    with pytest.raises(LaunchError, match=words):
        launch([sys.executable, "-c", program], print, tmp_path / "log.txt")


def test_an_error_message_in_a_file_is_reported(tmp_path):
    program = "import pathlib, sys; pathlib.Path(sys.argv[1]).write_text('error: rank 1 has died\\n'); sys.exit(1)"
    with pytest.raises(LaunchError, match=r"^rank 1 has died$"):
        launch([sys.executable, "-c", program, str(tmp_path / "error.txt")], print, tmp_path / "log.txt")


def test_a_program_that_is_killed(tmp_path):
    program = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    with pytest.raises(LaunchError, match="was killed, probably because memory ran out: it wrote no message"):
        launch([sys.executable, "-c", program], print, tmp_path / "log.txt")


def test_a_program_that_is_not_there(tmp_path):
    with pytest.raises(LaunchError, match="no-such-program is not installed"):
        launch(["no-such-program"], print, tmp_path / "log.txt")


def test_an_interruption_ends_the_program_and_its_children(tmp_path):
    program = "import subprocess, sys, time; subprocess.Popen(['sleep', '60']); print('up', flush=True); time.sleep(60)"

    def interrupt(_line: str) -> None:
        raise KeyboardInterrupt

    before = psutil.Process().children(recursive=True)
    children: list[psutil.Process] = []

    def look_then_interrupt(line: str) -> None:
        children.extend(set(psutil.Process().children(recursive=True)) - set(before))
        interrupt(line)

    start = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        launch([sys.executable, "-c", program], look_then_interrupt, tmp_path / "log.txt")
    assert len(children) == 2
    assert time.perf_counter() - start < 30
    _, alive = psutil.wait_procs(children, timeout=5)
    for process in alive:
        process.send_signal(signal.SIGKILL)
    assert alive == []


def test_mpirun_starts_from_a_process_that_initialised_mpi(tmp_path):
    launching = (
        "from mpi4py import MPI; from pathlib import Path; "
        "from reflowshock.workflow.process.launch import launch, mpi_command; "
        + (f"launch(mpi_command(2, ['true'], True), print, Path({str(tmp_path / 'log.txt')!r}))")
    )
    nested = (
        "import subprocess, sys; from mpi4py import MPI; sys.exit(subprocess.call([sys.executable, *sys.argv[1:]]))"
    )
    result = subprocess.run(
        [sys.executable, "-c", nested, "-c", launching], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
