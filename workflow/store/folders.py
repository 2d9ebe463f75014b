"""Run folders: marked as the program's, locked by one command at a time, and cleaned of the program's files."""

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from reflowshock.problem import Problem
from reflowshock.workflow import __version__
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.process.error_exit import LOG, LOGS
from reflowshock.workflow.store.product import discard
from reflowshock.workflow.store.store import HOME

MARK = ".reflowshock.json"
LOCK = ".lock"
PARTIAL = ".reflowshock.partial"  # an unfinished mark after a kill
UNKNOWN = {"holds": "run", "name": "an unknown case (its mark is damaged)"}


class RunFolderBusy(RuntimeError):
    """Error for a folder in which another process is running."""


def check_folder(folder: Path, what: str, name: str, force: bool = False) -> None:
    """Check that a folder is new, empty, or already used by the program for the same case or study.

    Args:
        folder: The folder.
        what: Kind of content, such as "run".
        name: Name of the case or study.
        force: Whether the folder may contain another case or study.

    Raises:
        CaseError: The path is a file, or the folder contains foreign files or another case or study.
    """
    try:
        folder.lstat()
        names = {path.name for path in folder.iterdir()}
    except FileNotFoundError:
        if HOME in folder.resolve().parts:
            words = f"is inside {HOME}, a folder from which the program removes files"
            raise _refused(folder, words, "a folder elsewhere") from None
        return
    except NotADirectoryError as error:
        raise _refused(folder, "is not a folder", "a folder, or the name of a new one") from error
    except OSError as error:
        raise _refused(folder, f"cannot be used: {error.strerror}", "a folder that can be written to") from error
    mark = read_mark(folder)
    if mark is None and {"inputs", "stages"} & names and ".snakemake" in names:
        raise _refused(folder, "was written by an earlier version of reflowshock", "another folder, or remove it")
    if mark is None and names - {LOCK, PARTIAL}:
        raise _refused(
            folder, "contains files that the program did not write", "an empty folder, or the name of a new one"
        )
    if mark is not None and (mark["holds"], mark["name"]) != (what, name) and not force:
        content = f"contains the {mark['holds']} of {mark['name']}, not the {what} of {name}"
        raise _refused(folder, content, "another folder, or --force")


def read_mark(folder: Path) -> dict[str, str] | None:
    """Return what a marked folder contains, or None for folders that the program has not marked.

    Args:
        folder: Folder of a run, study or convergence study.

    Returns:
        Kind ("run", "study", …) and name of the case or study.
    """
    try:
        mark = json.loads((folder / MARK).read_text(encoding="utf-8"))
        return {"holds": str(mark["holds"]), "name": str(mark["name"])}
    except FileNotFoundError:
        return UNKNOWN if (folder / HOME).is_dir() else None
    except (OSError, ValueError, KeyError, TypeError):
        return UNKNOWN


@contextmanager
def lock_folder(folder: Path, what: str, name: str, force: bool = False) -> Iterator[int]:
    """Create and mark a folder and hold its lock during a ``with`` block; the system releases it if the process ends.

    Args:
        folder: The folder.
        what: Kind of content, such as "run".
        name: Name of the case or study.
        force: Whether the folder may contain another case or study.

    Yields:
        The file descriptor that holds the lock.

    Raises:
        RunFolderBusy: Another process holds the lock.
        CaseError: The folder belongs to something else or is not writable.
    """
    check_folder(folder, what, name, force)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise _refused(
            folder, f"cannot be written into: {error.strerror}", "a folder that can be written to"
        ) from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise RunFolderBusy(f"another run is active in {folder}") from error
        if not _is_current_lock(folder / LOCK, descriptor):
            raise RunFolderBusy(f"another command has just removed {folder}; try again")
        _mark(folder, what, name)
        _clear_store(folder)
        yield descriptor
    finally:
        os.close(descriptor)


def is_busy(folder: Path) -> bool:
    """Return whether a process holds the lock of a folder, that is, computes in it.

    Args:
        folder: Folder of a run or study.
    """
    try:
        descriptor = os.open(folder / LOCK, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def remove_program_files(folder: Path) -> list[str]:
    """Remove store, logs, mark and lock of a folder, and the folder itself if it is then empty and not in use.

    Args:
        folder: Folder of a run or study; all other files stay.

    Returns:
        Names of the remaining entries.
    """
    if (folder / HOME).is_symlink():
        raise _refused(folder / HOME, "is a link", "a folder; remove the link yourself")
    discard(folder / HOME)
    for name in (MARK, LOCK, PARTIAL):
        (folder / name).unlink(missing_ok=True)
    _remove_logs(folder / LOGS)
    left = sorted(path.name for path in folder.iterdir())
    if not left and folder.resolve() not in (Path.cwd(), *Path.cwd().parents):
        folder.rmdir()
    return left


def _remove_logs(folder: Path) -> None:
    """Remove the program's error logs, then their folder if it is empty."""
    if folder.is_symlink() or not folder.is_dir():
        return
    for path in folder.glob(f"{LOG}*.txt"):
        path.unlink()
    with suppress(OSError):
        folder.rmdir()


def _mark(folder: Path, what: str, name: str) -> None:
    content = {"holds": what, "name": name, "version": __version__}
    path = folder / MARK
    if read_mark(folder) == {"holds": what, "name": name}:
        return
    partial = folder / PARTIAL
    partial.write_text(json.dumps(content) + "\n", encoding="utf-8")
    partial.replace(path)


def _is_current_lock(lock: Path, descriptor: int) -> bool:
    """Return whether the open lock file is still the one in the folder."""
    with suppress(FileNotFoundError):
        return os.path.samestat(lock.stat(), os.fstat(descriptor))
    return False


def _clear_store(folder: Path) -> None:
    """Remove files that occupy the paths of the store's folders, where only the program writes."""
    for name in ("", "products", "work", "views", ".snakemake"):
        if (path := folder / HOME / name).is_file():
            discard(path)


def _refused(folder: Path, message: str, allowed: str) -> CaseError:
    return CaseError("--out", [Problem("", f"{folder} {message}", None, allowed)])
