"""report.html and summary.json of a run, from its products: nothing is computed here that a product holds."""

import base64
import json
from pathlib import Path
from typing import Any

from reflowshock.workflow import __version__
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.fields import display_values
from reflowshock.workflow.convergence.discretisation import discretisation
from reflowshock.workflow.convergence.page import section_for
from reflowshock.workflow.effects.table import report_table
from reflowshock.workflow.kinds import kind_of
from reflowshock.workflow.report import tables
from reflowshock.workflow.report.errors import Discretisation
from reflowshock.workflow.report.scene import Scene
from reflowshock.workflow.report.template import write_page
from reflowshock.workflow.store.keys import inputs_digest
from reflowshock.workflow.store.product import read_record


def write_report(run_folder: Path, case: Case, folder: Path) -> dict:
    """Write ``report.html`` and ``summary.json``.

    Args:
        run_folder: folder of the run; stages that have not run are left out of the page.
        case: the resolved case.
        folder: where they are written.

    Returns:
        The summary.
    """
    summary, known = _concluded(run_folder, case)
    write_summary(folder, summary)
    write_page(folder / "report.html", "report.html.j2", _context(run_folder, case, summary, known))
    return summary


def moving_scene(run_folder: Path, case: Case) -> Scene | None:
    """Return the first scene of a run's report that moves: the drop, else the solder; None where nothing moves yet."""
    scenes = _context(run_folder, case, *_concluded(run_folder, case))["scenes"]
    found = (scenes[name] for name in ("view", "body") if name in scenes)
    return next((scene for scene in found if len(scene.frames) > 1), None)


def _concluded(run_folder: Path, case: Case) -> tuple[dict, Discretisation]:
    """Return the summary of a run with its conclusion, and the errors of its figures."""
    summary, known = collect_summary(run_folder, case), discretisation(run_folder, case)
    kind_of(case).conclude(run_folder, case, summary, known)
    return summary, known


def _context(run_folder: Path, case: Case, summary: dict, known: Discretisation) -> dict:
    context = {
        "case": case.case,
        "version": summary["version"],
        "inputs_sha256": summary["inputs_sha256"],
        "healthy": all(check["ok"] for check in summary["health"].values()),
        "headline": [],
        "health": tables.health_rows(summary["health"]),
        "tables": {
            "parameters": {
                "head": ["key", "value"],
                "rows": [[key, value] for key, value in display_values(case).items()],
            },
            "effects": report_table(case, summary["effects"]),
            "versions": tables.versions(),
        },
        "discretisation": known,
        "warnings": summary.get("warnings", []),
        "preview_caption": "Mesh of board and package, coloured by part. Joints are meshed after reflow.",
        "missed": [name.replace("_", " ") for name, check in summary["health"].items() if not check["ok"]],
        "not_run": [name for name in case.pipeline.names[:-1] if name not in summary["timings"]],
        "timings": summary["timings"],
        "curves": {},
        "scenes": {},
        "pictures": {},
    }
    preview = run_folder / "geometry/preview.png"
    if preview.exists():
        context["pictures"]["preview"] = base64.b64encode(preview.read_bytes()).decode()
    kind_of(case).report(run_folder, case, context, summary)
    context["accuracy"] = section_for(run_folder, case)
    return context


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
