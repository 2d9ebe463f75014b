"""Files that must not be trusted: damaged and foreign ones, and pickles that would run code."""

import io
import json
import pickle
from hashlib import sha256
from pathlib import Path

import numpy as np

from reflowshock.data_file import FORMAT


class Marking:
    """Object that creates a marker file when it is unpickled."""

    def __init__(self, marker: Path) -> None:
        self._marker = marker

    def __reduce__(self):
        return Path.touch, (self._marker,)


def forged_pickle(marker: Path) -> bytes:
    """Return the bytes of a pickle that creates the file ``marker`` when it is read."""
    return pickle.dumps(Marking(marker))


def forged_array(marker: Path) -> bytes:
    """Return the bytes of an NPZ file with one object array that creates the file ``marker`` when it is read."""
    archive = io.BytesIO()
    np.savez(archive, tree=np.array([Marking(marker)], object))
    return archive.getvalue()


def with_digest(content: bytes, rest: bytes) -> bytes:
    """Return the contents of a data file with the header of another one, a different body and a matching digest.

    Args:
        content: Contents of a file of ``write_data``, whose header is used.
        rest: Body of the new file.
    """
    new = content.split(b"\n", 2)[1] + b"\n" + rest
    return FORMAT + sha256(new).hexdigest().encode() + b"\n" + new


def flipped(content: bytes, share: float) -> bytes:
    """Return the contents of a file with one flipped bit.

    Args:
        content: Contents of the file.
        share: Position of the bit over the length, 0 to 1.
    """
    at = min(int(share * len(content)), len(content) - 1)
    return content[:at] + bytes([content[at] ^ 4]) + content[at + 1 :]


DAMAGES = {
    "pickle": lambda content, marker: forged_pickle(marker),
    "pickle with header": lambda content, marker: with_digest(content, forged_pickle(marker)),
    "pickled array": lambda content, marker: with_digest(content, forged_array(marker)),
    "pickle of an earlier version": lambda content, marker: (
        json.dumps({"owner": "x", "ranks": 1, "sha256": sha256(forged_pickle(marker)).hexdigest()}).encode()
        + b"\n"
        + forged_pickle(marker)
    ),
    "empty": lambda content, marker: b"",
    "one line": lambda content, marker: content[: content.index(b"\n")],
    "truncated": lambda content, marker: content[: len(content) // 2],
    "one byte short": lambda content, marker: content[:-1],
    "one byte more": lambda content, marker: content + b"\0",
    "flipped digest": lambda content, marker: flipped(content, 30 / len(content)),
    "flipped early": lambda content, marker: flipped(content, 0.3),
    "flipped late": lambda content, marker: flipped(content, 1.0),
    "text": lambda content, marker: b"a letter\nto a friend\n",
    "zeros": lambda content, marker: bytes(len(content)),
}
