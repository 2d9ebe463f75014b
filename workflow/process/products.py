"""Reading and writing of JSON products."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def read_json(path: Path) -> dict:
    """Return the content of a JSON file whose outermost value is a table, key -> value.

    Args:
        path: File to read, such as ``result.json``.
    """
    return json.loads(path.read_text(encoding="utf-8"))


def simulated_time(result: Mapping[str, Any]) -> float:
    """Return the time at which a run ended [s].

    Args:
        result: Content of its ``result.json``, of which ``model`` (``window`` [s], ``windows``) is read.
    """
    end: float = result["model"]["window"] * result["model"]["windows"]
    return end


def write_json(path: Path, content: dict | list) -> None:
    """Write data as a JSON file with one value per line.

    Args:
        path: File to write; an existing one is replaced.
        content: JSON data, a table or a list.
    """
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
