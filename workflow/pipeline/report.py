"""Report of a run: report.html and summary.json, assembled from the products without new computations."""

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
        run_folder: Run folder, which is read; stages without a product are omitted from the page.
        case: The resolved case.
        folder: Folder into which both files are written.

    Returns:
        Content of ``summary.json``, see ``collect_summary``.
    """
    summary, errors = _concluded(run_folder, case)
    write_summary(folder, summary)
    write_page(folder / "report.html", "report.html.j2", _context(run_folder, case, summary, errors))
    return summary


def moving_scene(run_folder: Path, case: Case) -> Scene | None:
    """Return the first animated scene of a report: the drop, otherwise the solder; None without animation.

    Args:
        run_folder: Run folder, whose products are read; no page is written.
        case: The resolved case.
    """
    scenes = _context(run_folder, case, *_concluded(run_folder, case))["scenes"]
    candidates = (scenes[name] for name in ("view", "body") if name in scenes)
    return next((scene for scene in candidates if len(scene.frames) > 1), None)


def _concluded(run_folder: Path, case: Case) -> tuple[dict, Discretisation]:
    """Return the summary of a run with its conclusions, and its discretisation errors."""
    summary, errors = collect_summary(run_folder, case), discretisation(run_folder, case)
    summary["errors"] = errors.record({})
    kind_of(case).conclude(run_folder, case, summary, errors)
    return summary, errors


def _context(run_folder: Path, case: Case, summary: dict, errors: Discretisation) -> dict:
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
        "discretisation": errors,
        "warnings": summary.get("warnings", []),
        "preview_caption": "Mesh of board and package, coloured by part. Joints are meshed after reflow.",
        "missed": [name.replace("_", " ") for name, check in summary["health"].items() if not check["ok"]],
        "not_run": [name for name in case.pipeline.names[:-1] if name not in summary["timings"]["wall"]],
        "timings": summary["timings"]["wall"],
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
        run_folder: Folder of the run.
        case: The resolved case.

    Returns:
        The contents of ``summary.json``: case, version, inputs_sha256, metrics, timings ("predicted" and "wall",
        each by stage [s]), effects, health.
        Stages without a product contribute nothing.
    """
    summary: dict[str, Any] = {
        "case": case.case.name,
        "version": __version__,
        "inputs_sha256": inputs_digest(case),
        "metrics": {},
        "timings": {"predicted": {}, "wall": {}},
        "effects": {},
        "health": {},
    }
    for stage in case.pipeline.names[:-1]:
        record = read_record(run_folder / stage)
        if record is None:
            continue
        summary["timings"]["wall"][stage] = record["seconds"]
        summary["timings"]["predicted"][stage] = record["forecast"]
        for key in ("metrics", "health"):
            summary[key].update(record[key])
        for name, effect in record["effects"].items():  # e.g. gravity, which reflow and shock both have
            summary["effects"][f"{name}_in_the_{stage}" if name in summary["effects"] else name] = effect
    return summary


def write_summary(folder: Path, summary: dict) -> None:
    """Write ``summary.json`` into a folder atomically.

    Args:
        folder: Folder of the file.
        summary: Content, see ``collect_summary``.
    """
    partial = folder / ".summary.json.partial"
    partial.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    partial.rename(folder / "summary.json")
