"""What this process and all that it starts need around them: text in UTF-8, places to write to, no MPI job of others.

Containers have no home, clusters a home that cannot be written to, scripts no locale: the libraries (Numba, FFCx,
Matplotlib, Snakemake, Open MPI) each fail in their own way then. Here it is mended for all of them, once.
"""

import os
import resource
import stat
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, MutableMapping
from contextlib import suppress
from pathlib import Path

from reflowshock.fem.parallel.mpi_environment import without_mpi_job
from reflowshock.workflow.process.kernel_folder import choose_kernel_folder

UTF8 = "PYTHONUTF8"
OUTPUT_ENCODING = "PYTHONIOENCODING"
ESCAPES = "backslashreplace"  # what an encoding does not have is written out
# The number of ranks, and the own one, as Open MPI, MPICH and Slurm's PMI say them.
RANKS = (("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"), ("PMI_SIZE", "PMI_RANK"))
# Folders that the libraries take from a variable, else from a place below the home.
PLACES = {
    "XDG_CACHE_HOME": ".cache", "XDG_CONFIG_HOME": ".config", "XDG_DATA_HOME": ".local/share",
    "XDG_STATE_HOME": ".local/state",
}  # fmt: skip
TEMPORARY = ("/tmp", "/var/tmp", "/dev/shm")  # where no variable names a folder
LAST_WORD = 3.0  # s: what a rank that says nothing leaves to the first one
DEFAULTS = {
    # PETSc would end a command whose reader has gone, or a stage whose structure was killed, before it can say so.
    "PETSC_OPTIONS": "-no_signal_handler",
    # A thread for each core would take memory that is limited, for products of small matrices.
    "OPENBLAS_NUM_THREADS": "1",
    "PATH": os.defpath,
}
# Limits of the shell below which nothing runs: a small case needs 1.4 GB of addresses, 24 files, 4 MB of MPI's own.
LEAST = (
    (resource.RLIMIT_AS, 2_000_000_000, "only {:.3g} MB of memory may be used (ulimit -v), {:g} MB are needed"),
    (
        resource.RLIMIT_FSIZE,
        16_000_000,
        "only files of {:.3g} MB may be written (ulimit -f), {:g} MB are needed",
    ),
)
LEAST_FILES = 64
WANTED_FILES = 4096
LEAST_THREADS, AMPLE_THREADS = 24, 1000


class EnvironmentProblem(RuntimeError):
    """The program cannot work where it was started."""

    def __init__(self, message: str, exit_code: int = 1, silent: bool = False) -> None:
        """Take what is wrong, with what the process ends, and whether another process says it."""
        super().__init__(message)
        self.exit_code, self.silent = exit_code, silent


def prepare() -> None:
    """Complete the environment of this process; heavy libraries must not be loaded yet.

    Raises:
        EnvironmentProblem: the program cannot work here.
    """
    check_ranks(os.environ)
    check_limits()
    write_any_text()
    complete(os.environ)


def begin_again_in_utf8() -> None:
    """Replace this process by the same one in Python's UTF-8 mode, where the locale has another encoding.

    Names of files, arguments and texts then are the same everywhere. Only the terminal keeps its own encoding.
    """
    if sys.flags.utf8_mode or sys.getfilesystemencoding() == "utf-8" or os.environ.get(UTF8) == "1":
        return
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    os.environ[UTF8] = "1"
    os.environ.setdefault(OUTPUT_ENCODING, f"{encoding}:{ESCAPES}")
    os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])


def write_any_text() -> None:
    """Let standard output and error write any text, in escapes where their encoding does not have it."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors=ESCAPES)


def complete(environment: MutableMapping[str, str]) -> None:
    """Add what is missing to an environment, for this process and its children; twice is as once.

    Raises:
        EnvironmentProblem: nowhere can a temporary file be written.
    """
    own = without_mpi_job(environment)
    for name in set(environment) - set(own):
        del environment[name]
    environment[UTF8] = "1"
    for name, value in DEFAULTS.items():
        environment.setdefault(name, value)
    if "DISPLAY" not in environment:
        # VTK would look for an X server first, and complain.
        environment.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    give_places(environment)
    choose_kernel_folder(environment)


def check_ranks(environment: Mapping[str, str]) -> None:
    """Refuse to be started on several ranks: each would do all the work, in the same folder.

    Raises:
        EnvironmentProblem: it was; the first rank says so, while the others wait: Open MPI 5 ends all ranks, heard or
            not, as soon as one has failed.
    """
    for size, rank in RANKS:
        count = environment.get(size, "")
        if count.isdigit() and int(count) > 1:
            is_first = environment.get(rank, "0") == "0"
            if not is_first:
                time.sleep(LAST_WORD)
            message = f"started on {count} MPI ranks; start it without mpirun, it starts its own ranks"
            raise EnvironmentProblem(message, 2, silent=not is_first)


def check_limits() -> None:
    """Refuse to work within limits of the shell that are too small, since libraries end in their own ways then.

    Raises:
        EnvironmentProblem: a limit is too small.
    """
    for number, least, message in LEAST:
        soft, _ = resource.getrlimit(number)
        if soft != resource.RLIM_INFINITY and soft < least:
            raise EnvironmentProblem(message.format(soft / 1e6, least / 1e6))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = WANTED_FILES if hard == resource.RLIM_INFINITY else min(hard, WANTED_FILES)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        soft = most
    if soft != resource.RLIM_INFINITY and soft < LEAST_FILES:
        raise EnvironmentProblem(f"only {soft} files may be open (ulimit -n), at least {LEAST_FILES} are needed")
    soft, _ = resource.getrlimit(resource.RLIMIT_NPROC)
    if soft != resource.RLIM_INFINITY and soft < AMPLE_THREADS and not _can_start(LEAST_THREADS):
        raise EnvironmentProblem(f"{LEAST_THREADS} more processes or threads cannot be started (ulimit -u {soft})")


def _can_start(count: int) -> bool:
    """Return whether some threads can be started beside all that this user has: by starting them."""
    over = threading.Event()
    threads = [threading.Thread(target=over.wait) for _ in range(count)]
    started = []
    try:
        for thread in threads:
            thread.start()
            started.append(thread)
    except RuntimeError:
        return False
    finally:
        over.set()
        for thread in started:
            thread.join()
    return True


def give_places(environment: MutableMapping[str, str]) -> None:
    """Name folders that can be written to, where those of the user cannot.

    Args:
        environment: HOME stays where it can be read, TMPDIR, MPLCONFIGDIR and ``PLACES`` where they can be written to.

    Raises:
        EnvironmentProblem: nowhere can a temporary file be written.
    """
    temporary = temporary_folder(environment)
    home = environment.get("HOME") or _home_of_user()
    if not os.path.isdir(home) or not os.access(home, os.R_OK | os.X_OK):
        home = str(private_folder(temporary))
    environment["HOME"] = home
    for name, place in PLACES.items():
        given = environment.get(name)
        if not (can_write(Path(given), make=True) if given else _can_hold(Path(home, place))):
            folder = private_folder(temporary) / place
            folder.mkdir(parents=True, exist_ok=True)
            environment[name] = str(folder)
    given = environment.get("MPLCONFIGDIR")
    if given and not can_write(Path(given), make=True):
        del environment["MPLCONFIGDIR"]


def temporary_folder(environment: MutableMapping[str, str]) -> Path:
    """Return where temporary files go, and name it to children where it is not what they would take.

    Raises:
        EnvironmentProblem: nowhere can a file be written.
    """
    named = [environment[name] for name in ("TMPDIR", "TEMP", "TMP") if environment.get(name)]
    tried = [*named, *TEMPORARY]
    found = next((folder for folder in tried if can_write(Path(folder))), None)
    if found is None:
        raise EnvironmentProblem(f"no folder for temporary files can be written to; tried: {', '.join(tried)}")
    if found != (named or TEMPORARY)[0]:
        environment["TMPDIR"] = found
        tempfile.tempdir = None  # what this process has found before
    return Path(found)


def private_folder(temporary: Path) -> Path:
    """Return a folder for temporary files of this user alone, the same each time, so that what is compiled is kept."""
    folder = temporary / f"reflowshock-{os.getuid()}"
    with suppress(OSError):
        folder.mkdir(mode=0o700)
    try:
        found = folder.lstat()
    except OSError:
        found = None
    if found is not None and stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022:
        return folder
    return Path(tempfile.mkdtemp(prefix="reflowshock-", dir=temporary))  # somebody else has made it


def can_write(folder: Path, make: bool = False) -> bool:
    """Return whether a file can be written in a folder: by writing one, since rights alone do not tell."""
    try:
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        descriptor, path = tempfile.mkstemp(prefix=".reflowshock-", dir=folder)
    except OSError:
        return False
    os.close(descriptor)
    with suppress(OSError):
        os.unlink(path)
    return True


def _can_hold(folder: Path) -> bool:
    """Return whether files can be written in a folder, or it can be made, in the nearest one that is there."""
    nearest = next(one for one in (folder, *folder.parents) if os.path.lexists(one))
    return can_write(nearest)


def _home_of_user() -> str:
    """Return the home that the system knows of this user; nothing where it knows none."""
    import pwd

    try:
        return pwd.getpwuid(os.getuid()).pw_dir
    except KeyError:
        return ""


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))
