"""summary.json: the machine-readable result of a run, merged from the records that the stages left."""

import hashlib
import json
from pathlib import Path
from typing import Any

from workflow import __version__

STAGES_WITH_RECORD = ("geometry", "reflow", "surface", "solder_mesh", "shock", "comparison")


def collect_summary(run_folder: Path, case_name: str) -> dict:
    """Merge the ``stage.json`` records of a run folder.

    Args:
        run_folder: folder of the run.
        case_name: name of the case.

    Returns:
        The contents of ``summary.json``: case, version, inputs_sha256, metrics, timings [s], effects, health.
        A stage that has not run contributes nothing.
    """
    summary: dict[str, Any] = {
        "case": case_name,
        "version": __version__,
        "inputs_sha256": inputs_digest(run_folder),
        "metrics": {},
        "timings": {},
        "effects": {},
        "health": {},
    }
    for stage in STAGES_WITH_RECORD:
        path = run_folder / stage / "stage.json"
        if not path.exists():
            continue
        record = json.loads(path.read_text(encoding="utf-8"))
        summary["timings"][stage] = record["seconds"]
        for key in ("metrics", "health"):
            summary[key].update(record[key])
        for name, effect in record["effects"].items():  # the shock has a gravity of its own
            summary["effects"][f"{name}_in_the_{stage}" if name in summary["effects"] else name] = effect
    return summary


def write_summary(run_folder: Path, summary: dict) -> None:
    """Write ``summary.json`` under a temporary name, then rename it."""
    partial = run_folder / ".summary.json.partial"
    partial.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    partial.rename(run_folder / "summary.json")


def inputs_digest(run_folder: Path) -> str:
    """SHA-256 of all resolved stage inputs of the run, in the order of their names."""
    digest = hashlib.sha256()
    for path in sorted((run_folder / "inputs").glob("*.json")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()
