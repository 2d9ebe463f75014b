"""Reading and writing of JSON products."""

import json
from pathlib import Path


def read_json(path: Path) -> dict:
    """Return the content of a JSON file whose outermost value is a table, key -> value.

    Args:
        path: File to read, such as ``result.json``.
    """
    return json.loads(path.read_text(encoding="utf-8"))


def write_json(path: Path, content: dict | list) -> None:
    """Write data as a JSON file with one value per line.

    Args:
        path: File to write; an existing one is replaced.
        content: JSON data, a table or a list.
    """
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
