"""Sections of the report on a scene of solder alone."""

import json
from pathlib import Path


def add_scene(run_folder: Path, kind: str, context: dict, summary: dict) -> None:
    """Add what is told of a scene of solder alone."""
    if not (run_folder / "reflow" / "shape.h5").exists():
        return
    from reflowshock.particles.scenes.products import read_body
    from reflowshock.workflow.report import body as report_body
    from reflowshock.workflow.report.pictures import embedded

    shape, meridian = read_body(run_folder / "reflow")
    context["headline"] = report_body.headline(summary["metrics"])
    context["tables"]["body"] = report_body.metric_table(summary["metrics"], summary["health"])
    if kind == "oscillation":
        context["curves"]["swing"] = report_body.swing_curve(shape.history, summary["metrics"])
    else:
        if shape.verdict != "apart":
            axis = report_body.middle(shape.surface_points) if kind == "drops" else 0.0
            context["curves"]["profile"] = report_body.profile_curve(shape.surface_points - axis, meridian)
        context["curves"]["body_history"] = report_body.history_curve(shape.history)
    path = run_folder / "reflow" / "path.json"
    if path.exists():
        kind, context["curves"]["path"] = "path", report_body.path_curve(json.loads(path.read_text(encoding="utf-8")))
    stages = report_body.stages(kind, shape)
    context["pictures"]["body"], _ = embedded(lambda picture: report_body.render_stages(stages, shape, picture))
