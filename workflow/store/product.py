"""Product of a stage: a folder sealed with the digests of its files, so that damage is detected.

The record ``stage.json`` holds the inputs and results of the stage, the SHA-256 of every file, and a digest of
itself.
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
TICK = 100_000_000  # two changes within this time may get the same time stamp [ns]

_digests: dict[tuple[int, int], tuple[tuple[int, int], str]] = {}  # file -> state when read, digest


def seal(folder: Path, record: dict) -> dict:
    """Write the record of a complete product and flush all its files to disk.

    Args:
        folder: Folder of the product, into which ``stage.json`` is written.
        record: Results of the stage, see ``run_stage``, without ``files``.

    Returns:
        The record with ``files`` (file name -> SHA-256) and the digest of the record itself.
    """
    files = {path.relative_to(folder).as_posix(): file_digest(path) for path in _files(folder)}
    sealed = json.loads(json.dumps(record | {"files": files}))  # the same types as after reading
    sealed[SEAL] = digest_of(sealed)
    (folder / RECORD).write_text(json.dumps(sealed, indent=1) + "\n", encoding="utf-8")
    for path in [*_files(folder), folder / RECORD, *(item for item in folder.rglob("*") if item.is_dir()), folder]:
        _sync(path)
    return sealed


def publish(made: Path, product: Path) -> None:
    """Move a sealed product to its final path atomically and remove an older product there.

    Args:
        made: Folder of the sealed product.
        product: Final path of this folder.
    """
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
    """Remove a file, folder or link of the store if it exists; targets of links stay.

    Args:
        path: Path to remove; a missing one is not an error.
    """
    if path.is_symlink() or not path.is_dir():
        path.unlink(missing_ok=True)
    else:
        shutil.rmtree(path)


def read_record(product: Path) -> dict | None:
    """Return the content of a product's ``stage.json``, or None if it is missing or damaged.

    Args:
        product: Folder of the product.
    """
    try:
        record = json.loads((product / RECORD).read_text(encoding="utf-8"))
        unsealed = {key: value for key, value in record.items() if key != SEAL}
        return record if record[SEAL] == digest_of(unsealed) else None
    except (OSError, ValueError, AttributeError, KeyError, TypeError, RecursionError):
        return None


def damage(product: Path) -> tuple[str, ...]:
    """List the damaged or missing files of a product as messages; empty if all files are intact.

    Args:
        product: Folder of the product; all its files are read.
    """
    record = read_record(product)
    if record is None:
        return (f"{RECORD} {'was modified' if (product / RECORD).exists() else 'is missing'}",)
    messages = []
    for name, digest in record["files"].items():
        try:
            same = file_digest(product / name) == digest
        except FileNotFoundError:
            messages.append(f"{name} is missing")
        except OSError as error:
            messages.append(f"{name} cannot be read ({error.strerror})")
        else:
            messages += [] if same else [f"{name} was modified"]
    return tuple(messages)


def content_digest(record: dict) -> str:
    """Return the digest of all files of a product except its record, which contains wall times.

    Args:
        record: Record of the product; its ``files`` are file name -> digest.
    """
    return digest_of(record["files"])


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal text; unchanged files are read only once per process.

    Args:
        path: File to read.
    """
    status = path.stat()
    identity, state = (status.st_dev, status.st_ino), (status.st_size, status.st_ctime_ns)
    if (cached := _digests.get(identity)) is not None and cached[0] == state:
        return cached[1]
    sha256 = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(CHUNK):
            sha256.update(chunk)
    if time.time_ns() - status.st_ctime_ns > TICK:
        _digests[identity] = (state, sha256.hexdigest())
    return sha256.hexdigest()


def _files(folder: Path) -> Iterator[Path]:
    """Yield the files of a product except its record, in sorted order."""
    yield from sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / RECORD)


def _sync(path: Path) -> None:
    """Flush a file, or the names in a folder, to disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
