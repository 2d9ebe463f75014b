"""Data files that can be read without executing any code in them.

The first line contains the format and the SHA-256 digest of the rest, the second a JSON header. The rest is an npz
archive with the arrays and a JSON tree (``TREE``) of the value. Records (dataclasses and pydantic models) are stored as
name and fields; a reader lists the types that it accepts, and creates no others.
"""

import hashlib
import io
import json
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

FORMAT = b"reflowshock data 1, sha256 "
TREE = "tree"
KIND = "@"  # key that marks types without a JSON equivalent
LONGEST_LINE = 65536


class NotData(ValueError):
    """Truncated or modified file, another format, or records that the reader does not accept."""


def write_data(path: Path, header: Mapping[str, Any], value: object) -> None:
    """Write a value to a file atomically: after a kill, either the old or the new file exists.

    Args:
        path: Path of the file; a missing folder is created.
        header: Plain data for JSON, one line at the start of the file that ``read_header`` returns.
        value: Arrays, numbers, text, paths and None, in dicts with names as keys, lists, tuples and records
            (dataclasses and pydantic models).

    Raises:
        TypeError: A part of the value has an unsupported type; the message names it.
    """
    packing = _Packing()
    tree = np.frombuffer(json.dumps(packing.put(value, "value")).encode(), np.uint8)
    archive = io.BytesIO()
    np.savez(archive, **{TREE: tree}, **packing.arrays)
    line, data = json.dumps(dict(header)).encode() + b"\n", archive.getbuffer()
    digest = hashlib.sha256(line)
    digest.update(data)
    write_atomically(path, FORMAT, digest.hexdigest().encode(), b"\n", line, data)


def read_header(path: Path) -> dict[str, Any]:
    """Return the header that ``write_data`` wrote into a file, without reading the rest.

    Raises:
        NotData: The file has no valid header.
    """
    try:
        with path.open("rb") as file:
            has_format = file.readline(LONGEST_LINE).startswith(FORMAT)
            header = json.loads(file.readline(LONGEST_LINE)) if has_format else None
    except (OSError, ValueError):
        header = None
    if not isinstance(header, dict):
        raise NotData(f"{path} is truncated, modified or of another format")
    return header


def read_data(path: Path, records: Collection[type] = ()) -> Any:
    """Return the value that ``write_data`` wrote into a file; reading runs no code from the file.

    Args:
        path: File that ``write_data`` has written.
        records: Dataclasses and pydantic models that may be in it; others raise an error.

    Raises:
        NotData: The file was modified, or contains records of other types.
    """
    archive = _checked(path)
    try:
        with np.load(io.BytesIO(archive), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        tree = json.loads(arrays.pop(TREE).tobytes())
        return _unpack(tree, arrays, {_name_of(record): record for record in records})
    except Exception as error:  # any error means that ``write_data`` has not written the file
        raise NotData(f"{path} has unexpected contents: {type(error).__name__}: {error}") from error


def _checked(path: Path) -> memoryview:
    """Return the npz archive of a file after checking its digest."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise NotData(f"{path} cannot be read: {error}") from error
    start = content.find(b"\n") + 1
    rest = memoryview(content)[start:]
    if content[:start] != FORMAT + hashlib.sha256(rest).hexdigest().encode() + b"\n":
        raise NotData(f"{path} is truncated, modified or of another format")
    return rest[content.find(b"\n", start) + 1 - start :]


def write_atomically(path: Path, *content: bytes | memoryview) -> None:
    """Replace a file atomically: after a kill, either the old or the new file exists.

    Args:
        path: Path of the file; a missing folder is created.
        content: Parts of the contents, written one after the other.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    with partial.open("wb") as file:
        file.writelines(content)
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)
    descriptor = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(descriptor)  # flushes the new name to disk
    finally:
        os.close(descriptor)


def columns(rows: Sequence[Mapping[str, Any]]) -> dict[str, NDArray]:
    """Return rows with equal keys as a table: key -> values of all rows, shape (k, ...), which is written faster.

    Args:
        rows: Rows, each key -> number, text or array of equal shape; the table of no rows is empty.
    """
    return {name: np.array([row[name] for row in rows]) for name in rows[0]} if rows else {}


def rows(table: Mapping[str, NDArray]) -> list[dict[str, Any]]:
    """Return the rows of a table, each key -> plain Python value or array; the inverse of ``columns``.

    Args:
        table: Key -> values of all rows, shape (k, ...).
    """
    parts = [column.tolist() if column.ndim == 1 else list(column) for column in table.values()]
    return [dict(zip(table, row, strict=True)) for row in zip(*parts, strict=True)]


def fields_of(record: object) -> dict[str, Any]:
    """Return the fields of a dataclass or pydantic model by name; raise TypeError for other objects."""
    if is_dataclass(record):
        return {field.name: getattr(record, field.name) for field in fields(record)}
    if hasattr(record, "model_dump"):
        return record.model_dump()
    raise TypeError(f"{type(record).__name__} is not a supported type")


def _name_of(record: type) -> str:
    return f"{record.__module__}.{record.__qualname__}"


class _Packing:
    """Collector of the arrays in a value; repeated arrays are stored once.

    Attributes:
        arrays: Arrays by name.
    """

    def __init__(self) -> None:
        self.arrays: dict[str, NDArray] = {}
        self._names: dict[int, str] = {}

    def put(self, value: Any, location: str) -> Any:
        """Return the JSON tree of a value; ``location`` is its path for names and messages."""
        match value:
            case None | bool() | int() | float() | str():
                return value
            case np.generic():
                return value.item()
            case np.ndarray():
                return {KIND: "array", "name": self._put_array(value, location)}
            case PurePath():
                return {KIND: "path", "path": str(value)}
            case list():
                return [self.put(item, f"{location}/{k}") for k, item in enumerate(value)]
            case tuple():
                return {KIND: "tuple", "items": self.put(list(value), location)}
            case Mapping():
                return self._put_items(value, location)
        return {KIND: _name_of(type(value)), "fields": self._put_items(fields_of(value), location)}

    def _put_items(self, items: Mapping[str, Any], location: str) -> dict[str, Any]:
        invalid = [key for key in items if not isinstance(key, str) or key == KIND]
        if invalid:
            raise TypeError(f"{location}: {invalid[0]!r} is not a valid name")
        return {key: self.put(value, f"{location}/{key}") for key, value in items.items()}

    def _put_array(self, array: NDArray, location: str) -> str:
        if array.dtype.hasobject:
            raise TypeError(f"{location}: arrays of objects are not supported")
        if id(array) not in self._names:
            name = location if location not in self.arrays else f"{location}~{len(self.arrays)}"
            self.arrays[name], self._names[id(array)] = array, name
        return self._names[id(array)]


def _unpack(tree: Any, arrays: Mapping[str, NDArray], records: Mapping[str, type]) -> Any:
    """Rebuild a value from its JSON tree and arrays."""
    if isinstance(tree, list):
        return [_unpack(item, arrays, records) for item in tree]
    if not isinstance(tree, dict):
        return tree
    match tree.get(KIND):
        case None:
            return {key: _unpack(value, arrays, records) for key, value in tree.items()}
        case "array":
            return arrays[tree["name"]]
        case "path":
            return Path(tree["path"])
        case "tuple":
            return tuple(_unpack(tree["items"], arrays, records))
        case kind:
            return records[kind](**_unpack(tree["fields"], arrays, records))
