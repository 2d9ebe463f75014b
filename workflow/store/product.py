"""A product: the folder that a stage has made, sealed with the digests of its files, so that damage is noticed.

Its record, ``stage.json``, says what the stage used, found and read, lists every file with its SHA-256, and has a
digest of its own.
"""

import hashlib
import json
import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

from reflowshock.workflow.store.keys import digest_of

RECORD = "stage.json"
SEAL = "sha256"  # key of the record's own digest
CHUNK = 1 << 20
TICK = 100_000_000  # two changes within this time may leave a file with one time stamp [ns]

_known: dict[tuple[int, int], tuple[tuple[int, int], str]] = {}  # file -> state when it was read, digest


def seal(folder: Path, record: dict) -> dict:
    """Write the record of a product whose files are complete, and see to it that all of it is on the disk.

    Args:
        folder: the product.
        record: what the stage says of itself.

    Returns:
        The record with ``files`` and its own digest.
    """
    files = {path.relative_to(folder).as_posix(): file_digest(path) for path in _files(folder)}
    sealed = json.loads(json.dumps(record | {"files": files}))  # as it will be read
    sealed[SEAL] = digest_of(sealed)
    (folder / RECORD).write_text(json.dumps(sealed, indent=1) + "\n", encoding="utf-8")
    for path in [*_files(folder), folder / RECORD, *(item for item in folder.rglob("*") if item.is_dir()), folder]:
        _sync(path)
    return sealed


def publish(made: Path, product: Path) -> None:
    """Move what a stage has made and sealed to its place, at once; what is there already goes."""
    product.parent.mkdir(parents=True, exist_ok=True)
    if os.path.lexists(product):
        old = made.with_name(f".{product.name}.old")
        discard(old)
        product.rename(old)
        made.rename(product)
        discard(old)
    else:
        made.rename(product)
    _sync(product.parent)


def discard(path: Path) -> None:
    """Remove what stands at a path of the store, if anything does; a link, not what it leads to."""
    if path.is_symlink() or not path.is_dir():
        path.unlink(missing_ok=True)
    else:
        shutil.rmtree(path)


def read_record(product: Path) -> dict | None:
    """Return the record of a product; None where there is none, or it is not as it was written."""
    try:
        record = json.loads((product / RECORD).read_text(encoding="utf-8"))
        unsealed = {key: value for key, value in record.items() if key != SEAL}
        return record if record[SEAL] == digest_of(unsealed) else None
    except (OSError, ValueError, AttributeError, KeyError, TypeError, RecursionError):
        return None


def damage(product: Path) -> tuple[str, ...]:
    """List what is wrong with a product that is there, in words; nothing where every file is as it was written."""
    record = read_record(product)
    if record is None:
        return (f"{RECORD} is {'not as it was written' if (product / RECORD).exists() else 'missing'}",)
    found = []
    for name, digest in record["files"].items():
        try:
            same = file_digest(product / name) == digest
        except FileNotFoundError:
            found.append(f"{name} is missing")
        except OSError as error:
            found.append(f"{name} cannot be read ({error.strerror})")
        else:
            found += [] if same else [f"{name} is not as it was written"]
    return tuple(found)


def content_digest(record: dict) -> str:
    """Return the digest of all that a product holds but for its record, whose times are those of one run."""
    return digest_of(record["files"])


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file; one that has not changed since this process read it is not read again."""
    status = path.stat()
    place, state = (status.st_dev, status.st_ino), (status.st_size, status.st_ctime_ns)
    if (known := _known.get(place)) is not None and known[0] == state:
        return known[1]
    found = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(CHUNK):
            found.update(chunk)
    if time.time_ns() - status.st_ctime_ns > TICK:
        _known[place] = (state, found.hexdigest())
    return found.hexdigest()


def _files(folder: Path) -> Iterator[Path]:
    """Yield the files of a product, but for its record, in an order that is always the same."""
    yield from sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / RECORD)


def _sync(path: Path) -> None:
    """See to it that a file, or the names in a folder, outlast a power cut."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
