"""Error exit of a command: every exception becomes one plain line and an exit code; tracebacks go to a log file.

Only the standard library is imported here, so that an interrupt during start-up is reported as well.
"""

import errno
import os
import re
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

FAILED, BAD_INPUT = 1, 2
INTERRUPTED = 130  # exit code of Typer after Ctrl-C
LOGS, LOG = "logs", "reflowshock-error-"  # folder for details in a run folder; prefix of the files
MAX_LENGTH = 400  # characters of a message of unknown origin
LAST_LINES = 5
END_SIGNALS = ("SIGTERM", "SIGHUP")  # signals treated like Ctrl-C

OWN_PACKAGE = "reflowshock"  # messages of errors defined in it are written for the user
NO_MEMORY = "out of memory (also limited by ulimit -v)"
SYSTEM_ERRORS = {
    errno.ENOSPC: "no space left on the device",
    errno.EDQUOT: "the disk quota is used up",
    errno.EFBIG: "the file would exceed the largest allowed size (ulimit -f)",
    errno.EROFS: "the file system is read-only",
    errno.EACCES: "permission denied",
    errno.EPERM: "permission denied",
    errno.ENOENT: "the file or folder does not exist or was removed",
    errno.EMFILE: "too many files are open (ulimit -n)",
    errno.ENFILE: "too many files are open on this machine",
    errno.ENOMEM: NO_MEMORY,
    errno.EAGAIN: "no further process or thread can be started (ulimit -u)",
    errno.EIO: "the device reports an input/output error",
    errno.ESTALE: "the network file system has lost the file",
}
WRITE_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
# Messages of libraries for the same conditions.
LIBRARY_ERRORS = (
    (re.compile(r"no space left on device|errno = 28\b", re.IGNORECASE), SYSTEM_ERRORS[errno.ENOSPC]),
    (re.compile(r"quota exceeded", re.IGNORECASE), SYSTEM_ERRORS[errno.EDQUOT]),
    (re.compile(r"file too large", re.IGNORECASE), SYSTEM_ERRORS[errno.EFBIG]),
    (re.compile(r"read-only file system", re.IGNORECASE), SYSTEM_ERRORS[errno.EROFS]),
    (re.compile(r"too many open files", re.IGNORECASE), SYSTEM_ERRORS[errno.EMFILE]),
    (re.compile(r"cannot allocate memory|out of memory|bad_alloc|unable to allocate", re.IGNORECASE), NO_MEMORY),
    (re.compile(r"failed to map segment|insufficient memory", re.IGNORECASE), NO_MEMORY),
    (re.compile(r"can't start new thread|resource temporarily unavailable", re.IGNORECASE),
     SYSTEM_ERRORS[errno.EAGAIN]),
    (re.compile(r"terminated abruptly|process pool", re.IGNORECASE),
     "a process was killed, probably because memory ran out"),
)  # fmt: skip
PETSC_ERRORS = {
    55: NO_MEMORY,
    56: "not supported by this PETSc",
    71: "zero pivot: the matrix is singular",
    76: "MUMPS failed",
}

_run_folder: dict[str, Path] = {}  # "folder": run folder of this process, if it has one


def set_run_folder(folder: Path) -> None:
    """Set the run folder of this process, into whose logs ``report_error`` writes tracebacks from now on.

    Args:
        folder: Run folder.
    """
    _run_folder["folder"] = folder


def describe_error(error: BaseException, where: Path | None = None) -> str:
    """Describe an error in one plain sentence.

    Args:
        error: Exception; its causes are examined as well.
        where: File or folder in use, named if the error itself names none.
    """
    if _is_project_error(error):
        return str(error)
    cause: BaseException | None = error
    while cause is not None:
        words = _describe_known(cause, where)
        if words:
            return words
        cause = cause.__cause__ or (None if cause.__suppress_context__ else cause.__context__)
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    kind = "" if type(error) is RuntimeError else type(error).__name__
    text = ": ".join(part for part in (kind, lines[0] if lines else "") if part) or "unknown error"
    return text if len(text) <= MAX_LENGTH else f"{text[:MAX_LENGTH]} …"


def _is_project_error(error: BaseException) -> bool:
    return type(error).__module__.partition(".")[0] == OWN_PACKAGE


def _describe_known(error: BaseException, where: Path | None) -> str:
    """Return a description of known system and library errors, or an empty string."""
    if isinstance(error, MemoryError):
        return NO_MEMORY
    code = int(getattr(error, "ierr", 0))  # set by PETSc
    if type(error).__module__.startswith("petsc4py"):
        return f"PETSc: {PETSC_ERRORS.get(code, f'error code {code}')}"
    location = _file_of(error, where)
    if isinstance(error, OSError) and error.errno in SYSTEM_ERRORS:
        context = " while writing" if error.errno in WRITE_ERRORS else ":" if location else ""
        return f"{SYSTEM_ERRORS[error.errno]}{context} {location}".rstrip() if location else SYSTEM_ERRORS[error.errno]
    words = describe_text(str(error))
    return (
        f"{words} while writing {location}"
        if words in (SYSTEM_ERRORS[number] for number in WRITE_ERRORS) and location
        else words
    )


def describe_text(text: str) -> str:
    """Return a plain description of a library message about exhausted resources, such as memory or disk space.

    Args:
        text: Message of a library.

    Returns:
        Sentence; empty if the message is about something else.
    """
    return next((words for pattern, words in LIBRARY_ERRORS if pattern.search(text)), "")


def _file_of(error: BaseException, where: Path | None) -> str:
    name = getattr(error, "filename", None)
    if isinstance(name, bytes):
        name = os.fsdecode(name)
    return str(name) if isinstance(name, str) and name else str(where or "")


def handle_signals() -> None:
    """Make this process treat SIGTERM and SIGHUP like Ctrl-C (``KeyboardInterrupt``) unless they are ignored."""
    for name in END_SIGNALS:
        number = getattr(signal, name)
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


def _interrupt(*_: object) -> NoReturn:
    raise KeyboardInterrupt


@contextmanager
def one_line_errors() -> Iterator[None]:
    """Convert every exception of a ``with`` block to an error message of one line, and end the process.

    The exit code is the one that ``report_error`` returns: 2 for errors of the input, 1 for others.

    Raises:
        SystemExit: The block raised an exception or ``SystemExit``; without an error the program continues.
    """
    try:
        yield
        _flush()
    except SystemExit as ended:
        _end(ended.code)
    except BaseException as error:
        code = report_error(error)
        if NO_MEMORY in describe_error(error):  # libraries would wait for threads that could not start
            os._exit(code)
        _end(code)


def run_app(app: Callable[..., Any]) -> None:
    """Run a Typer application; usage errors are reported in one line with exit code 2.

    Args:
        app: Typer application, which reads ``sys.argv``.

    Raises:
        SystemExit: Always, with the exit code, unless a command raises.
        BaseException: Any exception of the commands.
    """
    try:
        code = app(standalone_mode=False)
    except Exception as error:
        if not hasattr(error, "format_message"):  # Typer's errors come from whatever Click it has
            raise
        sys.exit(_report_usage(error))
    if code == INTERRUPTED:
        raise KeyboardInterrupt
    sys.exit(code if isinstance(code, int) else 0)


def report_error(error: BaseException) -> int:
    """Print an error in one line on standard error, write its traceback to a file, and return the exit code.

    Errors of the input have a line for each problem, the exit code 2 and no traceback. An interrupt and all other
    errors have the exit code 1, unless the error has an ``exit_code``. A closed pipe is not reported.

    Args:
        error: Exception that ends the program.
    """
    if is_interrupt(error):
        _print_error("interrupted")
        return FAILED
    if isinstance(error, BrokenPipeError):
        return FAILED  # the reader of the pipe has ended
    if getattr(error, "silent", False):
        return int(getattr(error, "exit_code", FAILED))
    if _is_project_error(error):
        lines = error.lines() if hasattr(error, "lines") else [str(error)]  # a CaseError has one line per problem
        for line in lines:
            _print_error(line)
        return BAD_INPUT if hasattr(error, "lines") else int(getattr(error, "exit_code", FAILED))
    details = "".join(traceback.format_exception(error))
    path = _write_details(details)
    if path is not None:
        _print_error(f"{describe_error(error)} (details: {path})")
    else:
        last = "\n".join(details.rstrip().splitlines()[-LAST_LINES:])
        _print_error(f"{describe_error(error)} (details cannot be written to a file; the last lines are:)\n{last}")
    return FAILED


def is_interrupt(error: BaseException | None) -> bool:
    """Return whether an error stems from Ctrl-C or a similar signal; compiled functions wrap it, Click renames it."""
    if error is None:
        return False
    return isinstance(error, KeyboardInterrupt) or type(error).__name__ == "Abort" or is_interrupt(error.__cause__)


def _write_details(details: str) -> Path | None:
    """Write details to the logs of the run or a temporary file; return its path, or None if neither is possible."""
    folder, folders = _run_folder.get("folder"), []
    with suppress(OSError):  # a name that is too long
        folders += [folder / LOGS] if folder is not None and folder.is_dir() else []
    with suppress(OSError):
        folders.append(Path(tempfile.gettempdir()))
    for location in folders:
        with suppress(OSError):
            location.mkdir(exist_ok=True)
            descriptor, path = tempfile.mkstemp(".txt", LOG, location, text=True)
            try:
                with os.fdopen(descriptor, "w", encoding="utf-8", errors="backslashreplace") as file:
                    file.write(details)
            except OSError:
                os.unlink(path)
                raise
            return Path(path)
    return None


def _report_usage(error: Any) -> int:
    if type(error).__name__ == "NoArgsIsHelpError":  # it prints the help itself
        return int(error.exit_code)
    context = getattr(error, "ctx", None)
    hint = f"; for help: {context.command_path} --help" if context is not None else ""
    _print_error(f"{error.format_message().rstrip('.')}{hint}")
    return int(error.exit_code)


def _print_error(text: str) -> None:
    """Print an error with rich, or plainly if rich cannot be loaded (no memory)."""
    with suppress(OSError):  # the terminal is closed
        try:
            from reflowshock.workflow.process.terminal import print_error

            print_error(text)
        except (ImportError, MemoryError, RuntimeError):
            sys.stderr.write(f"error: {text}\n")


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()


def _end(code: object) -> NoReturn:
    """Exit with a code in spite of unwritable output streams or another Ctrl-C."""
    with suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        _flush()
    except OSError as error:
        if not isinstance(error, BrokenPipeError):
            _print_error(describe_error(error, Path("standard output")))
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = code or FAILED
    raise SystemExit(code)
