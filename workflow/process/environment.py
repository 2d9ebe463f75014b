"""Process environment: UTF-8 text, writable folders, resource limits, and isolation from an outer MPI job.

Containers without a home, clusters with a read-only home and scripts without a locale make the libraries (Numba, FFCx,
Matplotlib, Snakemake, Open MPI) fail in various ways. This module corrects the environment once for all of them.
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
ESCAPES = "backslashreplace"  # characters missing in an encoding are written as escapes
# Variables with the number of ranks and the rank of this process: Open MPI, then MPICH and Slurm's PMI.
RANKS = (("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"), ("PMI_SIZE", "PMI_RANK"))
# Variables of user folders, and the default subfolders of the home.
USER_FOLDERS = {
    "XDG_CACHE_HOME": ".cache", "XDG_CONFIG_HOME": ".config", "XDG_DATA_HOME": ".local/share",
    "XDG_STATE_HOME": ".local/state",
}  # fmt: skip
TEMPORARY = ("/tmp", "/var/tmp", "/dev/shm")  # used if no variable names a folder
RANK_DELAY = 3.0  # time that the other ranks leave to the first one for its message [s]
DEFAULTS = {
    # The signal handler of PETSc would end the process before it can report its error.
    "PETSC_OPTIONS": "-no_signal_handler",
    # One thread per core would waste memory on products of small matrices.
    "OPENBLAS_NUM_THREADS": "1",
    "PATH": os.defpath,
}
# Limits of the shell below which nothing runs: a small case needs 1.4 GB of addresses, 24 files, 4 MB for MPI.
MINIMUM_LIMITS = (
    (resource.RLIMIT_AS, 2_000_000_000, "only {:.3g} MB of memory may be used (ulimit -v), {:g} MB are needed"),
    (
        resource.RLIMIT_FSIZE,
        16_000_000,
        "only files of {:.3g} MB may be written (ulimit -f), {:g} MB are needed",
    ),
)
MINIMUM_FILES = 64
TARGET_FILES = 4096
GROUP, UNLIMITED = Path("/sys/fs/cgroup"), 1e9
MINIMUM_THREADS, AMPLE_THREADS = 24, 1000


class EnvironmentProblem(RuntimeError):
    """Unsuitable environment, such as a resource limit that is too small."""

    def __init__(self, message: str, exit_code: int = 1, silent: bool = False) -> None:
        """Store message and exit code; silent if another process prints the message."""
        super().__init__(message)
        self.exit_code, self.silent = exit_code, silent


def prepare() -> None:
    """Complete the environment variables of this process and check its limits; heavy libraries must not be loaded yet.

    Raises:
        EnvironmentProblem: No folder for temporary files is writable, the command was started on several MPI ranks, or
            a limit of the shell is too small.
    """
    check_ranks(os.environ)
    check_limits()
    escape_unencodable()
    complete(os.environ)


def restart_in_utf8() -> None:
    """Restart this process in Python's UTF-8 mode if the locale has another encoding.

    File names, arguments and texts are then independent of the locale. Only the terminal keeps its encoding.
    """
    if sys.flags.utf8_mode or sys.getfilesystemencoding() == "utf-8" or os.environ.get(UTF8) == "1":
        return
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    os.environ[UTF8] = "1"
    os.environ.setdefault(OUTPUT_ENCODING, f"{encoding}:{ESCAPES}")
    os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])


def escape_unencodable() -> None:
    """Make standard output and error write characters that the terminal's encoding lacks as escapes, not as errors."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors=ESCAPES)


def complete(environment: MutableMapping[str, str]) -> None:
    """Add the variables that this process and its children need and remove those of an MPI job.

    Variables set by the user stay if they are usable; repeated calls change nothing.

    Args:
        environment: Variables by name, changed in place, usually ``os.environ``.

    Raises:
        EnvironmentProblem: No folder for temporary files is writable.
    """
    cleaned = without_mpi_job(environment)
    for name in set(environment) - set(cleaned):
        del environment[name]
    environment[UTF8] = "1"
    for name, value in DEFAULTS.items():
        environment.setdefault(name, value)
    if "DISPLAY" not in environment:
        # VTK would otherwise look for an X server and print warnings.
        environment.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    set_writable_folders(environment)
    choose_kernel_folder(environment)


def check_ranks(environment: Mapping[str, str]) -> None:
    """Raise if the command was started on several MPI ranks, each of which would do all the work.

    Args:
        environment: Variables by name, in which MPI gives number of ranks and rank.

    Raises:
        EnvironmentProblem: There are several ranks. The first rank prints the message while the others wait, because
            Open MPI 5 ends all ranks as soon as one has failed.
    """
    for size, rank in RANKS:
        count = environment.get(size, "")
        if count.isdigit() and int(count) > 1:
            is_first = environment.get(rank, "0") == "0"
            if not is_first:
                time.sleep(RANK_DELAY)
            message = f"started on {count} MPI ranks; start it without mpirun, it starts its own ranks"
            raise EnvironmentProblem(message, 2, silent=not is_first)


def check_limits() -> None:
    """Raise if a limit of the shell is too small, since libraries would fail without a clear message.

    Checked are memory, size of files, number of open files (raised to a sufficient number if the system allows it), and
    number of threads.

    Raises:
        EnvironmentProblem: A limit is too small; the message names it with its ``ulimit`` option.
    """
    for number, least, message in MINIMUM_LIMITS:
        soft, _ = resource.getrlimit(number)
        if soft != resource.RLIM_INFINITY and soft < least:
            raise EnvironmentProblem(message.format(soft / 1e6, least / 1e6))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = TARGET_FILES if hard == resource.RLIM_INFINITY else min(hard, TARGET_FILES)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        soft = most
    if soft != resource.RLIM_INFINITY and soft < MINIMUM_FILES:
        raise EnvironmentProblem(f"only {soft} files may be open (ulimit -n), at least {MINIMUM_FILES} are needed")
    soft, _ = resource.getrlimit(resource.RLIMIT_NPROC)
    if soft != resource.RLIM_INFINITY and soft < AMPLE_THREADS and not _can_start(MINIMUM_THREADS):
        raise EnvironmentProblem(f"{MINIMUM_THREADS} more processes or threads cannot be started (ulimit -u {soft})")


def _can_start(count: int) -> bool:
    """Return whether a number of threads can be started in addition to the user's processes, by trying it."""
    release = threading.Event()
    threads = [threading.Thread(target=release.wait) for _ in range(count)]
    started = []
    try:
        for thread in threads:
            thread.start()
            started.append(thread)
    except RuntimeError:
        return False
    finally:
        release.set()
        for thread in started:
            thread.join()
    return True


def set_writable_folders(environment: MutableMapping[str, str]) -> None:
    """Replace folders of the user that are not writable by private temporary folders.

    Args:
        environment: Variables to correct. A readable HOME and writable TMPDIR, MPLCONFIGDIR and ``USER_FOLDERS`` stay.

    Raises:
        EnvironmentProblem: No folder for temporary files is writable.
    """
    temporary = temporary_folder(environment)
    home = environment.get("HOME") or _home_of_user()
    if not os.path.isdir(home) or not os.access(home, os.R_OK | os.X_OK):
        home = str(private_folder(temporary))
    environment["HOME"] = home
    for name, subfolder in USER_FOLDERS.items():
        folder_of_user = environment.get(name)
        if not (can_write(Path(folder_of_user), make=True) if folder_of_user else _can_hold(Path(home, subfolder))):
            folder = private_folder(temporary) / subfolder
            folder.mkdir(parents=True, exist_ok=True)
            environment[name] = str(folder)
    folder_of_user = environment.get("MPLCONFIGDIR")
    if folder_of_user and not can_write(Path(folder_of_user), make=True):
        del environment["MPLCONFIGDIR"]


def temporary_folder(environment: MutableMapping[str, str]) -> Path:
    """Return a writable folder for temporary files and set TMPDIR if children would choose another one.

    Args:
        environment: Variables by name; TMPDIR is changed in place.

    Raises:
        EnvironmentProblem: No folder is writable.
    """
    named = [environment[name] for name in ("TMPDIR", "TEMP", "TMP") if environment.get(name)]
    candidates = [*named, *TEMPORARY]
    writable = next((folder for folder in candidates if can_write(Path(folder))), None)
    if writable is None:
        raise EnvironmentProblem(f"no folder for temporary files can be written to; tried: {', '.join(candidates)}")
    if writable != (named or TEMPORARY)[0]:
        environment["TMPDIR"] = writable
        tempfile.tempdir = None  # clears the cached choice of this process
    return Path(writable)


def private_folder(temporary: Path) -> Path:
    """Return a private temporary folder of this user, always the same so that compiled code is reused.

    Args:
        temporary: Folder for temporary files, in which it is created if missing.
    """
    folder = temporary / f"reflowshock-{os.getuid()}"
    with suppress(OSError):
        folder.mkdir(mode=0o700)
    try:
        info = folder.lstat()
    except OSError:
        info = None
    if info is not None and stat.S_ISDIR(info.st_mode) and info.st_uid == os.getuid() and not info.st_mode & 0o022:
        return folder
    return Path(tempfile.mkdtemp(prefix="reflowshock-", dir=temporary))  # created by another user


def can_write(folder: Path, make: bool = False) -> bool:
    """Return whether a file can be written in a folder, by trying it, since permissions alone are not sufficient.

    Args:
        folder: Folder to try.
        make: Whether a missing folder is created; otherwise it counts as not writable.
    """
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
    """Return whether a folder, or its nearest existing parent, is writable."""
    nearest = next(path for path in (folder, *folder.parents) if os.path.lexists(path))
    return can_write(nearest)


def _home_of_user() -> str:
    """Return the home of this user from the password database, or an empty string."""
    import pwd

    try:
        return pwd.getpwuid(os.getuid()).pw_dir
    except KeyError:
        return ""


def available_cores() -> int:
    """Return the number of cores that this process may use, at least one."""
    return max(1, min(len(os.sched_getaffinity(0)), int(group_cores())))


def group_cores(group: Path = GROUP) -> float:
    """Return the number of cores that the control group of a container grants; 1e9 without a limit.

    Args:
        group: Folder of the control group, of version 2 (``cpu.max``) or 1 (``cpu/cpu.cfs_quota_us``).
    """
    with suppress(OSError, ValueError):
        quota, period = (group / "cpu.max").read_text().split()
        return UNLIMITED if quota == "max" else float(quota) / float(period)
    with suppress(OSError, ValueError):
        quota, period = ((group / f"cpu/cpu.cfs_{name}_us").read_text() for name in ("quota", "period"))
        return UNLIMITED if float(quota) <= 0.0 else float(quota) / float(period)
    return UNLIMITED
