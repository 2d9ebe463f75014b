"""What is said last: whatever ends the program becomes one plain line and an exit code, never a traceback.

Nothing but the standard library is loaded before something is to be said, so that an interrupt while the program loads
is reported, too.
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
INTERRUPTED = 130  # what Typer makes of Ctrl-C
LOGS, LOG = "logs", "reflowshock-error-"  # folder of a run that takes the details; how its files begin
LONGEST = 400  # characters of a message of unknown origin
LAST_LINES = 5
ENDING = ("SIGTERM", "SIGHUP")  # signals that end a command as Ctrl-C does

OWN_PACKAGE = "reflowshock"  # the text of errors that it defines is for the user
NO_MEMORY = "out of memory (also limited by ulimit -v)"
SYSTEM = {
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
WRITING = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
# What libraries say in errors of their own about the same.
LIBRARIES = (
    (re.compile(r"no space left on device|errno = 28\b", re.IGNORECASE), SYSTEM[errno.ENOSPC]),
    (re.compile(r"quota exceeded", re.IGNORECASE), SYSTEM[errno.EDQUOT]),
    (re.compile(r"file too large", re.IGNORECASE), SYSTEM[errno.EFBIG]),
    (re.compile(r"read-only file system", re.IGNORECASE), SYSTEM[errno.EROFS]),
    (re.compile(r"too many open files", re.IGNORECASE), SYSTEM[errno.EMFILE]),
    (re.compile(r"cannot allocate memory|out of memory|bad_alloc|unable to allocate", re.IGNORECASE), NO_MEMORY),
    (re.compile(r"failed to map segment|insufficient memory", re.IGNORECASE), NO_MEMORY),
    (re.compile(r"can't start new thread|resource temporarily unavailable", re.IGNORECASE), SYSTEM[errno.EAGAIN]),
    (re.compile(r"terminated abruptly|process pool", re.IGNORECASE),
     "a process was killed, probably because memory ran out"),
)  # fmt: skip
PETSC = {55: NO_MEMORY, 56: "not supported by this PETSc", 71: "zero pivot: the matrix is singular", 76: "MUMPS failed"}

_known: dict[str, Path] = {}  # "folder": of the run


def remember_run_folder(folder: Path) -> None:
    """Say which run folder is this program's own, so that details of an error go to its logs."""
    _known["folder"] = folder


def in_words(error: BaseException, where: Path | None = None) -> str:
    """Say in one plain sentence what went wrong.

    Args:
        error: what was raised; what is behind it is looked at, too.
        where: file or folder that was worked on, named where the error names none.
    """
    if _is_own(error):
        return str(error)
    behind: BaseException | None = error
    while behind is not None:
        words = _known_words(behind, where)
        if words:
            return words
        behind = behind.__cause__ or (None if behind.__suppress_context__ else behind.__context__)
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    kind = "" if type(error) is RuntimeError else type(error).__name__
    text = ": ".join(part for part in (kind, lines[0] if lines else "") if part) or "unknown error"
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} …"


def _is_own(error: BaseException) -> bool:
    return type(error).__module__.partition(".")[0] == OWN_PACKAGE


def _known_words(error: BaseException, where: Path | None) -> str:
    """Return the words for errors of the system and of libraries that are known; nothing for others."""
    if isinstance(error, MemoryError):
        return NO_MEMORY
    code = int(getattr(error, "ierr", 0))  # of PETSc
    if type(error).__module__.startswith("petsc4py"):
        return f"PETSc: {PETSC.get(code, f'error code {code}')}"
    place = _place(error, where)
    if isinstance(error, OSError) and error.errno in SYSTEM:
        does = " while writing" if error.errno in WRITING else ":" if place else ""
        return f"{SYSTEM[error.errno]}{does} {place}".rstrip() if place else SYSTEM[error.errno]
    words = words_of(str(error))
    return f"{words} while writing {place}" if words in (SYSTEM[one] for one in WRITING) and place else words


def words_of(text: str) -> str:
    """Return plain words for what a library says of a system that ends; nothing where it says something else."""
    return next((words for pattern, words in LIBRARIES if pattern.search(text)), "")


def _place(error: BaseException, where: Path | None) -> str:
    name = getattr(error, "filename", None)
    if isinstance(name, bytes):
        name = os.fsdecode(name)
    return str(name) if isinstance(name, str) and name else str(where or "")


def heed_signals() -> None:
    """Let the signals that end a command, or that a lost terminal sends, do what Ctrl-C does; one ignored stays so."""
    for name in ENDING:
        number = getattr(signal, name)
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


def _interrupt(*_: object) -> NoReturn:
    raise KeyboardInterrupt


@contextmanager
def last_word() -> Iterator[None]:
    """Let nothing but ``SystemExit`` through: one line has been said then, or nothing needs to be."""
    try:
        yield
        _flush()
    except SystemExit as ended:
        _end(ended.code)
    except BaseException as error:
        code = say(error)
        if NO_MEMORY in in_words(error):  # libraries that could not start their threads would wait for them at the end
            os._exit(code)
        _end(code)


def answer(app: Callable[..., Any]) -> None:
    """Run a Typer application; its usage errors are one line, with exit code 2.

    Raises:
        SystemExit: always, with the exit code.
        BaseException: what the commands raise.
    """
    try:
        code = app(standalone_mode=False)
    except Exception as error:
        if not hasattr(error, "format_message"):  # Typer's errors come from whatever Click it has
            raise
        sys.exit(_say_usage(error))
    if code == INTERRUPTED:
        raise KeyboardInterrupt
    sys.exit(code if isinstance(code, int) else 0)


def say(error: BaseException) -> int:
    """Say why the program ends, in one line, and return the exit code."""
    if is_interrupt(error):
        _print_error("interrupted")
        return FAILED
    if isinstance(error, BrokenPipeError):
        return FAILED  # whoever read has gone: nobody reads it
    if getattr(error, "silent", False):
        return int(getattr(error, "exit_code", FAILED))
    if _is_own(error):
        lines = error.lines() if hasattr(error, "lines") else [str(error)]  # of a CaseError
        for line in lines:
            _print_error(line)
        return BAD_INPUT if hasattr(error, "lines") else int(getattr(error, "exit_code", FAILED))
    details = "".join(traceback.format_exception(error))
    path = _keep(details)
    if path is not None:
        _print_error(f"{in_words(error)} (details: {path})")
    else:
        last = "\n".join(details.rstrip().splitlines()[-LAST_LINES:])
        _print_error(f"{in_words(error)} (details cannot be written to a file; the last lines are:)\n{last}")
    return FAILED


def is_interrupt(error: BaseException | None) -> bool:
    """Return whether Ctrl-C, or a signal like it, is behind an error: compiled functions wrap it, Click renames it."""
    if error is None:
        return False
    return isinstance(error, KeyboardInterrupt) or type(error).__name__ == "Abort" or is_interrupt(error.__cause__)


def _keep(details: str) -> Path | None:
    """Write details to the logs of the run, else to a temporary file; return which, or None where neither can be."""
    folder, places = _known.get("folder"), []
    with suppress(OSError):  # a name that is too long
        places += [folder / LOGS] if folder is not None and folder.is_dir() else []
    with suppress(OSError):
        places.append(Path(tempfile.gettempdir()))
    for place in places:
        with suppress(OSError):
            place.mkdir(exist_ok=True)
            descriptor, path = tempfile.mkstemp(".txt", LOG, place, text=True)
            try:
                with os.fdopen(descriptor, "w", encoding="utf-8", errors="backslashreplace") as file:
                    file.write(details)
            except OSError:
                os.unlink(path)
                raise
            return Path(path)
    return None


def _say_usage(error: Any) -> int:
    if type(error).__name__ == "NoArgsIsHelpError":  # what it shows is the help
        return int(error.exit_code)
    context = getattr(error, "ctx", None)
    hint = f"; for help: {context.command_path} --help" if context is not None else ""
    _print_error(f"{error.format_message().rstrip('.')}{hint}")
    return int(error.exit_code)


def _print_error(text: str) -> None:
    """Print an error; where even that fails, as without memory, by the plainest means."""
    with suppress(OSError):  # the terminal has gone
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
    """End with an exit code; what cannot be written any more does not disturb the end, nor does another Ctrl-C."""
    with suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        _flush()
    except OSError as error:
        if not isinstance(error, BrokenPipeError):
            _print_error(in_words(error, Path("standard output")))
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = code or FAILED
    raise SystemExit(code)
