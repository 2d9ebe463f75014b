"""The command in hard environments: no home, no locale, read-only folders, odd names, small limits."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from reflowshock.workflow.process.kernel_folder import VARIABLE

ROOT = Path(__file__).resolve().parents[2]
TITLE = "Lötstelle [/x] [ ] [bold]b $\\\\frac{$ :smile: <b> 焊"  # in TOML, where \\ is one backslash
NOBODY = ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups"]
ENVIRONMENTS = {
    "nothing": {},
    "home that is not there": {"HOME": "/nonexistent"},
    "home that cannot be written to": {"HOME": "/proc"},
    "cache that cannot be written to": {"HOME": "/tmp", "XDG_CACHE_HOME": "/proc/x"},
    "read-only folder for temporary files": {"TMPDIR": "/proc"},
    "C": {"LANG": "C", "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
    "POSIX": {"LC_ALL": "POSIX", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
    "another encoding": {"PYTHONIOENCODING": "iso-8859-1", "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0"},
}
QUICK = ("nothing", "C", "another encoding")


@pytest.fixture
def user_folder():
    """Yield a folder open to all users, with a case of few particles and an awkward title.

    The folders of pytest are closed to other users.
    """
    text = (ROOT / "cases/sessile_drop/case.toml").read_text(encoding="utf-8")
    text = text.replace("particles_per_edge = 11", "particles_per_edge = 5")
    text = text.replace("1 mm cube of solder on a wall, contact angle 60 deg", f"{TITLE}\\u001b[31m")
    assert TITLE in text
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o777)
        Path(folder, "case.toml").write_text(text, encoding="utf-8")
        yield Path(folder)


def command(folder: Path, *arguments: str, environment: dict | None = None, before: list[str] | None = None):
    """Run a command of the program in a folder; return the completed process, with output as bytes."""
    defaults = {"PYTHONPATH": str(ROOT)} | (environment if environment is not None else dict(os.environ))
    line = [*(before or []), sys.executable, "-m", "reflowshock", *arguments]
    return subprocess.run(line, cwd=folder, env=defaults, capture_output=True, timeout=300, check=False)


def is_plain(text: bytes) -> bool:
    """Return whether output has no control characters and no traceback."""
    return not any(byte in text for byte in (b"\x1b", b"\x07", b"Traceback", b"\xc2\x9b"))


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in ENVIRONMENTS]
)
def test_a_plan_in_any_environment(user_folder, name):
    done = command(user_folder, "plan", "case.toml", "--out", "Gehäuse [x] ü", environment=ENVIRONMENTS[name])
    assert (done.returncode, done.stderr.decode()) == (0, "")
    assert b"[/x] [ ] [bold]b $" in done.stdout
    assert rb"\x1b[31m" in done.stdout
    assert is_plain(done.stdout)
    written = {"C": rb"L\xf6tstelle", "POSIX": rb"L\xf6tstelle", "another encoding": "Lötstelle".encode("latin-1")}
    assert written.get(name, "Lötstelle".encode()) in done.stdout


@pytest.mark.parametrize("kernels", ["given", pytest.param("to be compiled", marks=pytest.mark.long)])
def test_a_run_of_a_user_without_anything(user_folder, kernels):
    """A run needs no locale and no home; kernels are copied, since compiling them takes long.

    Their temporary folder is tested with ``kernel_cache``.
    """
    root, out = os.geteuid() == 0, "Gehäuse [x] ü"
    environment = ENVIRONMENTS["C"] | {"TMPDIR": str(user_folder), "HOME": "/nonexistent"}
    if kernels == "given":
        shutil.copytree(os.environ[VARIABLE], user_folder / "kernels")
        for folder, _, names in os.walk(user_folder / "kernels"):
            for path in (Path(folder), *(Path(folder, name) for name in names)):
                path.chmod(0o777)
        environment[VARIABLE] = str(user_folder / "kernels")
    done = command(
        user_folder, "run", "case.toml", "--out", out, environment=environment, before=NOBODY if root else []
    )
    assert (done.returncode, done.stderr.decode()) == (0, "")
    assert is_plain(done.stdout)
    report = user_folder / out / "report.html"
    page = report.read_text(encoding="utf-8")
    assert "Lötstelle [/x] [ ] [bold]b $\\frac{$ :smile: &lt;b&gt; 焊\\x1b[31m" in page
    assert report.stat().st_uid == (65534 if root else os.geteuid())


def mpirun(ranks: int) -> list[str]:
    """Return the words that start a program on a number of MPI ranks."""
    root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
    return ["mpirun", *root, "--oversubscribe", "-n", str(ranks)]


def test_a_run_within_a_job_of_mpi(user_folder):
    line = ("run", "case.toml", "--out", "out", "--until", "reflow")
    assert command(user_folder, *line, before=mpirun(1)).returncode == 0


def test_several_ranks_are_refused_in_one_line(user_folder):
    done = command(user_folder, "run", "case.toml", "--out", "out", before=mpirun(2))
    assert done.returncode == 2
    assert done.stderr.count(b"error: started on 2 MPI ranks; start it without mpirun, it starts its own ranks") == 1
    assert not (user_folder / "out").exists()


@pytest.mark.parametrize(
    "limit, words",
    [
        ("-v 300000", b"error: only 307 MB of memory may be used (ulimit -v)"),
        ("-v 60000", b"error: only 61.4 MB of memory may be used (ulimit -v)"),
        ("-n 16", b"error: only 16 files may be open (ulimit -n)"),
        ("-f 8", b"error: only files of 0.00"),
    ],
)
def test_a_limit_of_the_shell_is_told_in_one_line(user_folder, limit, words):
    before = ["bash", "-c", f'ulimit {limit}; exec "$@"', "bash"]
    done = command(user_folder, "run", "case.toml", "--out", "out", before=before)
    assert done.returncode == 1
    assert done.stderr.startswith(words)
    assert done.stderr.count(b"\n") == 1


@pytest.mark.skipif(os.geteuid() != 0, reason="mounts a file system")
def test_a_full_device_is_told_in_plain_words(user_folder):
    disk = user_folder / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(disk)], check=False).returncode:
        pytest.skip("nothing can be mounted here")
    try:
        done = command(user_folder, "run", "case.toml", "--out", "disk/out")
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=False)
    assert done.returncode == 1
    assert b"no space left on" in done.stderr.lower()
