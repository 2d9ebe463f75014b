"""summary.json: the machine-readable result of a run, merged from the records that the stages left."""

import json
from pathlib import Path
from typing import Any

from reflowshock.workflow import __version__
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.store.keys import inputs_digest
from reflowshock.workflow.store.product import read_record


def collect_summary(run_folder: Path, case: Case) -> dict:
    """Merge the records of a run's stages.

    Args:
        run_folder: folder of the run.
        case: the resolved case.

    Returns:
        The contents of ``summary.json``: case, version, inputs_sha256, metrics, timings [s], effects, health.
        A stage that has not run contributes nothing.
    """
    summary: dict[str, Any] = {
        "case": case.case.name,
        "version": __version__,
        "inputs_sha256": inputs_digest(case),
        "metrics": {},
        "timings": {},
        "effects": {},
        "health": {},
    }
    for stage in case.pipeline.names[:-1]:
        record = read_record(run_folder / stage)
        if record is None:
            continue
        summary["timings"][stage] = record["seconds"]
        for key in ("metrics", "health"):
            summary[key].update(record[key])
        for name, effect in record["effects"].items():  # the shock has a gravity of its own
            summary["effects"][f"{name}_in_the_{stage}" if name in summary["effects"] else name] = effect
    return summary


def write_summary(folder: Path, summary: dict) -> None:
    """Write ``summary.json`` under a temporary name, then rename it."""
    partial = folder / ".summary.json.partial"
    partial.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    partial.rename(folder / "summary.json")
