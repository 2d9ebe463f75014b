"""Files of data: reading one never runs anything that stands in it.

The first line has the format and the SHA-256 digest of all that follows, the second a header in JSON. The rest is an
npz: arrays, and in JSON (`TREE`) how a value is put together of them. Records, dataclasses and pydantic models, stand
there as their name and fields; a reader lists those that it takes, and makes no others.
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
KIND = "@"  # key of what JSON does not know
LONGEST_LINE = 65536


class NotData(ValueError):
    """A file is broken off, changed, of another format or not of the records that a reader takes."""


def write_data(path: Path, header: Mapping[str, Any], value: object) -> None:
    """Replace a file; a kill at any moment leaves the old one or the new one.

    Args:
        path: file; its folder is made where there is none.
        header: what `read_header` returns.
        value: arrays, numbers, text, paths and None, in dicts with names as keys, lists, tuples and records.

    Raises:
        TypeError: something in the value is no data; names it.
    """
    packing = _Packing()
    tree = np.frombuffer(json.dumps(packing.put(value, "value")).encode(), np.uint8)
    archive = io.BytesIO()
    np.savez(archive, **{TREE: tree}, **packing.arrays)
    line, data = json.dumps(dict(header)).encode() + b"\n", archive.getbuffer()
    digest = hashlib.sha256(line)
    digest.update(data)
    write_at_once(path, FORMAT, digest.hexdigest().encode(), b"\n", line, data)


def read_header(path: Path) -> dict[str, Any]:
    """Return the header of a file without looking at the rest.

    Raises:
        NotData: there is none.
    """
    try:
        with path.open("rb") as file:
            known = file.readline(LONGEST_LINE).startswith(FORMAT)
            header = json.loads(file.readline(LONGEST_LINE)) if known else None
    except (OSError, ValueError):
        header = None
    if not isinstance(header, dict):
        raise NotData(f"{path} is broken off, changed or of another format")
    return header


def read_data(path: Path, records: Collection[type] = ()) -> Any:
    """Return the value in a file.

    Args:
        path: file that `write_data` has written.
        records: dataclasses and pydantic models that may be in it.

    Raises:
        NotData: it is not what was written, or there are other records in it.
    """
    archive = _checked(path)
    try:
        with np.load(io.BytesIO(archive), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        tree = json.loads(arrays.pop(TREE).tobytes())
        return _taken(tree, arrays, {_name_of(record): record for record in records})
    except Exception as error:  # whatever it is: `write_data` has not written this
        raise NotData(f"{path} is not made of what is expected: {type(error).__name__}: {error}") from error


def _checked(path: Path) -> memoryview:
    """Return the npz of a file that is whole."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise NotData(f"{path} cannot be read: {error}") from error
    begin = content.find(b"\n") + 1
    rest = memoryview(content)[begin:]
    if content[:begin] != FORMAT + hashlib.sha256(rest).hexdigest().encode() + b"\n":
        raise NotData(f"{path} is broken off, changed or of another format")
    return rest[content.find(b"\n", begin) + 1 - begin :]


def write_at_once(path: Path, *content: bytes | memoryview) -> None:
    """Replace a file; a kill at any moment leaves the old one or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    with partial.open("wb") as file:
        file.writelines(content)
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)
    descriptor = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(descriptor)  # makes the new name last
    finally:
        os.close(descriptor)


def columns(rows: Sequence[Mapping[str, Any]]) -> dict[str, NDArray]:
    """Return rows that have the same names as arrays by name: a file with few arrays is written fast."""
    return {name: np.array([row[name] for row in rows]) for name in rows[0]} if rows else {}


def rows(table: Mapping[str, NDArray]) -> list[dict[str, Any]]:
    """Return the rows of which `columns` has made a table."""
    parts = [column.tolist() if column.ndim == 1 else list(column) for column in table.values()]
    return [dict(zip(table, row, strict=True)) for row in zip(*parts, strict=True)]


def fields_of(record: object) -> dict[str, Any]:
    """Return the fields of a dataclass or pydantic model by name."""
    if is_dataclass(record):
        return {field.name: getattr(record, field.name) for field in fields(record)}
    if hasattr(record, "model_dump"):
        return record.model_dump()
    raise TypeError(f"{type(record).__name__} is no data")


def _name_of(record: type) -> str:
    return f"{record.__module__}.{record.__qualname__}"


class _Packing:
    """Collects the arrays of a value; one that stands in several places is kept once.

    Attributes:
        arrays: name -> array.
    """

    def __init__(self) -> None:
        self.arrays: dict[str, NDArray] = {}
        self._names: dict[int, str] = {}

    def put(self, value: Any, place: str) -> Any:
        """Return what JSON says of a value; `place` is where it stands, for names and messages."""
        match value:
            case None | bool() | int() | float() | str():
                return value
            case np.generic():
                return value.item()
            case np.ndarray():
                return {KIND: "array", "name": self._put_array(value, place)}
            case PurePath():
                return {KIND: "path", "path": str(value)}
            case list():
                return [self.put(item, f"{place}/{k}") for k, item in enumerate(value)]
            case tuple():
                return {KIND: "tuple", "items": self.put(list(value), place)}
            case Mapping():
                return self._put_items(value, place)
        return {KIND: _name_of(type(value)), "fields": self._put_items(fields_of(value), place)}

    def _put_items(self, items: Mapping[str, Any], place: str) -> dict[str, Any]:
        odd = [key for key in items if not isinstance(key, str) or key == KIND]
        if odd:
            raise TypeError(f"{place}: {odd[0]!r} is no name")
        return {key: self.put(value, f"{place}/{key}") for key, value in items.items()}

    def _put_array(self, array: NDArray, place: str) -> str:
        if array.dtype.hasobject:
            raise TypeError(f"{place}: an array of objects is no data")
        if id(array) not in self._names:
            name = place if place not in self.arrays else f"{place}~{len(self.arrays)}"
            self.arrays[name], self._names[id(array)] = array, name
        return self._names[id(array)]


def _taken(tree: Any, arrays: Mapping[str, NDArray], records: Mapping[str, type]) -> Any:
    """Put a value together."""
    if isinstance(tree, list):
        return [_taken(item, arrays, records) for item in tree]
    if not isinstance(tree, dict):
        return tree
    match tree.get(KIND):
        case None:
            return {key: _taken(value, arrays, records) for key, value in tree.items()}
        case "array":
            return arrays[tree["name"]]
        case "path":
            return Path(tree["path"])
        case "tuple":
            return tuple(_taken(tree["items"], arrays, records))
        case kind:
            return records[kind](**_taken(tree["fields"], arrays, records))
