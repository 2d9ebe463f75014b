"""The sources of packages, to which checkpoints and compiled kernels belong."""

import hashlib
from pathlib import Path

MATERIALS = Path(__file__).parent / "materials"  # laws that solvers compile


def digest_of_sources(*folders: Path) -> bytes:
    """Return a digest of all Python files below some folders: constants and decorators of a kernel are anywhere."""
    found = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            found.update(path.read_bytes())
    return found.digest()
