"""Reading and writing of JSON products."""

import json
from pathlib import Path


def read_json(path: Path) -> dict:
    """Return the content of a JSON product whose outermost value is a table, key -> value."""
    return json.loads(path.read_text(encoding="utf-8"))


def write_json(path: Path, content: dict | list) -> None:
    """Write a JSON product with one value per line."""
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
