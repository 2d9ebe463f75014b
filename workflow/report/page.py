"""report.html: one self-contained page from the products of a run. Nothing is computed here that a product holds."""

import base64
import json
import tempfile
from pathlib import Path

import jinja2
import numpy as np

from workflow import findings
from workflow.board_drop_case import BoardDropCase
from workflow.report import tables
from workflow.structure.case import StructureCase
from workflow.summary import collect_summary, write_summary

TEMPLATES = Path(__file__).parent / "templates"


def write_report(run_folder: Path, case) -> dict:
    """Write ``report.html`` and ``summary.json`` at the top of a run folder.

    Args:
        run_folder: folder of the run; stages that have not run are left out of the page.
        case: the resolved case (``workflow.case.Case``).

    Returns:
        The summary.
    """
    summary = collect_summary(run_folder, case.case.name)
    write_summary(run_folder, summary)
    page = _render(_context(run_folder, case, summary))
    partial = run_folder / ".report.html.partial"
    partial.write_text(page)
    partial.rename(run_folder / "report.html")
    return summary


def _render(context: dict) -> str:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=jinja2.select_autoescape(["html", "j2"]),
        undefined=jinja2.ChainableUndefined,
    )
    return environment.get_template("report.html.j2").render(context)


def _context(run_folder: Path, case, summary: dict) -> dict:
    context = {
        "case": case.case,
        "version": summary["version"],
        "inputs_sha256": summary["inputs_sha256"],
        "healthy": all(check["ok"] for check in summary["health"].values()),
        "headline": tables.headline(summary["metrics"]),
        "health": tables.health_rows(summary["health"]),
        "tables": {
            "parameters": tables.parameters(case),
            "effects": tables.effects(summary["effects"]),
            "versions": tables.versions(),
        },
        "preview_caption": "Mesh of board and package, coloured by part. Joints are meshed after reflow.",
        "curves": {},
        "pictures": {},
    }
    if summary["timings"]:
        from workflow.report.curves import timing_bars

        context["curves"]["timings"] = timing_bars(summary["timings"])
    _add_preview(run_folder, context)
    _add_joints(run_folder, context)
    _add_body(run_folder, case.kind, context, summary)
    if isinstance(case, StructureCase):
        _add_structure(run_folder, case, context, summary)
    else:
        _add_shock(run_folder, case, context, summary)
    return context


def _add_preview(run_folder: Path, context: dict) -> None:
    preview = run_folder / "geometry" / "preview.png"
    if preview.exists():
        context["pictures"]["preview"] = _base64(preview)


def _add_joints(run_folder: Path, context: dict) -> None:
    if (run_folder / "reflow" / "joints.json").exists():
        context["tables"]["verdicts"] = tables.verdicts(run_folder)
        _add_bridge(run_folder, context)
    path = run_folder / "solder_mesh" / "quality.json"
    if not path.exists():
        return
    from workflow.report.curves import array_map
    from workflow.report.pictures import render_shapes

    joints = tables.joint_records(run_folder)
    context["tables"]["shapes"] = tables.shapes(joints)
    context["curves"]["map"] = array_map(joints)
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "shapes.png"
        render_shapes(run_folder / "surface", joints, picture)
        context["pictures"]["shapes"] = _base64(picture)


def _add_bridge(run_folder: Path, context: dict) -> None:
    """Add the picture of two joints that became one, the only shape under two names."""
    from particles.products import read_shapes
    from workflow.report.body import render_stages

    for name, shape in read_shapes(run_folder / "reflow" / "shapes.h5").items():
        if "+" in name:
            context["bridge_caption"] = (
                f"{name} as one body: particles and free surface, right by pressure above ambient."
            )
            with tempfile.TemporaryDirectory() as folder:
                picture = Path(folder) / "bridge.png"
                render_stages(shape.snapshots[:1], shape, picture)
                context["pictures"]["bridge"] = _base64(picture)


def _add_body(run_folder: Path, kind: str, context: dict, summary: dict) -> None:
    """Add what is told of a scene of solder alone."""
    if not (run_folder / "reflow" / "shape.h5").exists():
        return
    from particles.products import read_body
    from workflow import work_precision
    from workflow.report import body as report_body
    from workflow.report.curves import svg

    shape, meridian = read_body(run_folder / "reflow")
    context["headline"] = report_body.headline(summary["metrics"])
    context["tables"]["body"] = report_body.metric_table(summary["metrics"], summary["health"])
    measured = work_precision.stored() if kind == "drop" else None
    if measured is not None:
        context["tables"]["work_precision"] = work_precision.table(measured)
        context["curves"]["work_precision"] = svg(work_precision.figure(measured))
    if kind == "oscillation":
        context["curves"]["swing"] = report_body.swing_curve(shape.history, summary["metrics"])
    else:
        if shape.verdict != "apart":
            axis = report_body.middle(shape.surface_points) if kind == "drops" else 0.0
            context["curves"]["profile"] = report_body.profile_curve(shape.surface_points - axis, meridian)
        context["curves"]["body_history"] = report_body.history_curve(shape.history)
    path = run_folder / "reflow" / "path.json"
    if path.exists():
        kind, context["curves"]["path"] = "path", report_body.path_curve(json.loads(path.read_text()))
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "body.png"
        report_body.render_stages(report_body.stages(kind, shape), shape, picture)
        context["pictures"]["body"] = _base64(picture)


def _add_structure(run_folder: Path, case: StructureCase, context: dict, summary: dict) -> None:
    from workflow.structure.report import add_structure

    context["preview_caption"] = "Mesh, coloured by layer."
    add_structure(run_folder, case, context, summary["metrics"])


def _add_shock(run_folder: Path, case, context: dict, summary: dict) -> None:
    histories, results = {}, {}
    for mode in ("two_scale", "dns"):
        folder = run_folder / "shock" / mode
        if (folder / "history.npz").exists():
            with np.load(folder / "history.npz") as arrays:
                histories[mode] = dict(arrays)
            results[mode] = json.loads((folder / "result.json").read_text())
    if not histories:
        return
    from workflow.report.curves import energy_curves, history_curves

    main_mode = next(iter(histories))
    ranked = "dns" if "dns" in results and findings.fine_joints_of(results[main_mode]) else main_mode
    critical_joint = summary["metrics"]["critical_joint"]["value"]
    context["late_peak"] = tables.late_peak(histories[main_mode])
    context["curves"]["histories"] = history_curves(histories, critical_joint)
    context["curves"]["energy"] = energy_curves(histories[main_mode])
    context["ranked_by"] = (
        f"of the {tables.mode_name(ranked)}, whose joints are all fine" if ranked != main_mode else ""
    )
    context["tables"].update(
        model=tables.models(results),
        comparison=tables.comparison(summary["metrics"]),
        joints=tables.ranked_joints(
            histories[ranked],
            tables.joint_records(run_folder),
            results[ranked]["failure"],
            findings.fine_joints_of(results[ranked]),
        ),
        energy=tables.energies(histories),
        cost=tables.costs(results),
    )
    _add_two_scales(run_folder, case, context, results)
    _add_shock_pictures(run_folder / "shock" / main_mode, histories[main_mode], results[main_mode], context)


def _add_two_scales(run_folder: Path, case: BoardDropCase, context: dict, results: dict[str, dict]) -> None:
    """Add how the models are coupled, where they are."""
    from workflow.fine_joints import read_fine_joints
    from workflow.report import two_scales as scales
    from workflow.shock_forecast import implicit_seconds

    result = results.get("two_scale")
    if result is None:
        return
    coupling = result.get("coupling", {})
    context["tables"].update(
        two_scales=scales.two_scales(coupling, result["model"], read_fine_joints(run_folder / "shock")),
        levels=scales.levels(coupling),
        placement=scales.placement(coupling),
    )
    seconds = implicit_seconds(case)
    search = run_folder / "shock/coarse/result.json"
    runs = [result, json.loads(search.read_text())] if search.exists() else [result]
    context["oracle"] = scales.oracle(seconds, runs) if seconds is not None else ""


def _add_shock_pictures(folder: Path, history: dict, result: dict, context: dict) -> None:
    from workflow.report.pictures import render_board, render_joints

    names = ("dns", "macro", "meso")
    whole = {name: folder / f"{name}.pvd" for name in names if (folder / f"{name}.pvd").exists()}
    is_one_way = result.get("coupling", {}).get("direction") == "one_way"
    joints, board = ([whole["meso"]], [whole["macro"]]) if is_one_way else 2 * (list(whole.values()),)
    with tempfile.TemporaryDirectory() as temporary:
        pictures = {name: Path(temporary) / f"{name}.png" for name in ("joints", "board")}
        context["joints_caption"] = render_joints(joints, history, result["parts"], pictures["joints"])
        context["board_caption"] = render_board(board, history, result["parts"], pictures["board"])
        context["pictures"] |= {name: _base64(path) for name, path in pictures.items()}


def _base64(path: Path) -> str:
    return base64.b64encode(path.read_bytes()).decode()
