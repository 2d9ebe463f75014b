"""Digest of source files, which identifies checkpoints and compiled kernels."""

import hashlib
from pathlib import Path

MATERIALS = Path(__file__).parent / "materials"  # material laws compiled into kernels


def digest_of_sources(*folders: Path) -> bytes:
    """Return the SHA-256 digest of the contents of all Python files below some folders, 32 bytes.

    Args:
        folders: Folders that are searched with their subfolders, in this order.
    """
    sha256 = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            sha256.update(path.read_bytes())
    return sha256.digest()
