"""report.html: one self-contained page from the products of a run. Nothing is computed here that a product holds."""

import base64
from pathlib import Path

from reflowshock.workflow.report import tables
from reflowshock.workflow.report.joints import add_joints
from reflowshock.workflow.report.scenes import add_scene
from reflowshock.workflow.report.summary import collect_summary, write_summary
from reflowshock.workflow.report.template import template_environment
from reflowshock.workflow.structure.case import StructureCase

TEMPLATES = Path(__file__).parent / "templates"


def write_report(run_folder: Path, case, folder: Path) -> dict:
    """Write ``report.html`` and ``summary.json``.

    Args:
        run_folder: folder of the run; stages that have not run are left out of the page.
        case: the resolved case (``workflow.pipeline.reader.Case``).
        folder: where they are written.

    Returns:
        The summary.
    """
    summary = collect_summary(run_folder, case)
    write_summary(folder, summary)
    write_page(folder / "report.html", "report.html.j2", _context(run_folder, case, summary))
    return summary


def write_page(path: Path, template: str, context: dict) -> None:
    """Write a page from one of the templates, under a temporary name, then rename it."""
    environment = template_environment(TEMPLATES)
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(environment.get_template(template).render(context), encoding="utf-8", errors="backslashreplace")
    partial.rename(path)


def _context(run_folder: Path, case, summary: dict) -> dict:
    context = {
        "case": case.case,
        "version": summary["version"],
        "inputs_sha256": summary["inputs_sha256"],
        "healthy": all(check["ok"] for check in summary["health"].values()),
        "headline": [],
        "health": tables.health_rows(summary["health"]),
        "tables": {
            "parameters": tables.parameters(case),
            "effects": tables.effects(case, summary["effects"]),
            "versions": tables.versions(),
        },
        "preview_caption": "Mesh of board and package, coloured by part. Joints are meshed after reflow.",
        "curves": {},
        "pictures": {},
    }
    if summary["timings"]:
        from reflowshock.workflow.report.curves import timing_bars

        context["curves"]["timings"] = timing_bars(summary["timings"])
    preview = run_folder / "geometry/preview.png"
    if preview.exists():
        context["pictures"]["preview"] = base64.b64encode(preview.read_bytes()).decode()
    _add_sections(run_folder, case, context, summary)
    from reflowshock.workflow.convergence.page import section_for

    context["accuracy"] = section_for(run_folder, case)
    return context


def _add_sections(run_folder: Path, case, context: dict, summary: dict) -> None:
    """Add the sections of a kind of case."""
    if isinstance(case, StructureCase):
        from reflowshock.workflow.structure.report import add_structure

        context["preview_caption"] = "Mesh, coloured by layer."
        add_structure(run_folder, case, context, summary["metrics"])
    elif case.kind == "package":
        from reflowshock.workflow.report.shock import add_shock

        add_joints(run_folder, context)
        add_shock(run_folder, case, context, summary)
    else:
        add_scene(run_folder, case.kind, context, summary)
