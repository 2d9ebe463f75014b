"""Table rows that are stored as soon as they are computed, so that an interrupted run continues."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import reflowshock.cases.hard.trials
import reflowshock.fem

SOURCES = (reflowshock.fem, reflowshock.cases.hard.trials)  # code whose changes invalidate stored rows


class StoredRows:
    """File of JSON lines with one row each; rows of other sources or parameters are ignored."""

    def __init__(self, path: Path, parameters: object) -> None:
        """Read the valid rows of a file and remove an incomplete last line."""
        self._path, self._key = path, digest_of(parameters)
        path.parent.mkdir(parents=True, exist_ok=True)
        whole = path.read_text(encoding="utf-8").rpartition("\n")[0] if path.exists() else ""
        path.write_text(f"{whole}\n" if whole else "", encoding="utf-8")
        rows = [json.loads(line) for line in whole.splitlines()]
        self._rows = {row["name"]: row["value"] for row in rows if row["key"] == self._key}

    def get(self, name: str, compute: Callable[[], Any]) -> Any:
        """Return the row of a name, computed and stored if it is missing."""
        if name not in self._rows:
            self._rows[name] = compute()
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"key": self._key, "name": name, "value": self._rows[name]}) + "\n")
        return self._rows[name]


def digest_of(parameters: object) -> str:
    """Return a digest of parameters, by their ``repr``, and of all measured source files, 16 hexadecimal digits."""
    digest = hashlib.sha256(repr(parameters).encode())
    for package in SOURCES:
        for path in sorted(Path(package.__path__[0]).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
