"""Sections of the report on the shock of a package: stresses, what the shapes change, two scales, energies, cost."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from reflowshock.workflow.case.text import micro
from reflowshock.workflow.package import findings
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.package_report import joint_tables
from reflowshock.workflow.package_report.joint_records import joint_records
from reflowshock.workflow.package_report.residual import add_residual
from reflowshock.workflow.report import tables
from reflowshock.workflow.report.histories import MODES, late_peak, read_modes


def add_shock(run_folder: Path, case: BoardDropCase, context: dict, summary: dict) -> None:
    """Add what is told of the shock, where it was run."""
    shock = run_folder / "shock"
    histories, results = read_modes(shock)
    if not histories:
        return
    from reflowshock.workflow.package_report import cost
    from reflowshock.workflow.report.curves import difference_curves, energy_curves, history_curves

    main = next(iter(histories))
    metrics = summary["metrics"]
    joints = joint_records(run_folder)
    critical = metrics["critical_joint"]["value"]
    figures = tables.headline(metrics)  # the critical joint and its stress come first
    context["headline"] = figures[:2] + margins(results[main]) + figures[2:] + context["headline"]
    context["late_peak"] = late_peak(histories[main])
    context["kinematics"] = kinematics_note(metrics, case.shock.numerics.kinematics)
    context["curves"] |= {
        "histories": history_curves(histories, critical),
        "differences": difference_curves(histories, critical),
        "energy": energy_curves(histories[main]),
    }
    context["tables"].update(
        model=tables.models(results),
        comparison=tables.comparison(metrics),
        energy=tables.energies(histories),
        cost=tables.costs(results),
        published_cost=cost.table(results, metrics),
    )
    context["published_source"] = cost.PAPER
    _add_ranks(histories, results, joints, context)
    _add_shape_effect(shock, histories[main], (joints, metrics), context)
    _add_interface(shock, context)
    add_residual(shock, results[main]["parts"], context)
    _add_two_scales(run_folder, case, context, results)
    _add_pictures(shock / main, histories[main], results[main], context)


def margins(result: Mapping) -> list[dict]:
    """The least margin of the joints to a limit that the case sets, as a figure of the headline."""
    ratios = {
        (verdict["limit"] / verdict["value"], joint, criterion)
        for criterion, verdicts in result.get("failure", {}).items()
        for joint, verdict in verdicts.items()
        if verdict["value"] > 0.0
    }
    if not ratios:
        return []
    ratio, joint, criterion = min(ratios)
    label = f"least margin, limit over {criterion.replace('_', ' ')} of {joint}"
    return [{"value": f"{ratio:.2f}", "label": label}]


def kinematics_note(metrics: dict, kinematics: str) -> str:
    """Say what small kinematics leave out, where that matters; else nothing."""
    from reflowshock.fem.materials.kinematics import NEGLIGIBLE_STRAIN

    left_out = metrics.get("peak_neglected_strain", {}).get("value", 0.0)
    if kinematics == "finite" or left_out <= NEGLIGIBLE_STRAIN:
        return ""
    ratio = metrics["deflection_over_thickness"]["value"]
    strain = tables.named_quantity(metrics, "peak_board_strain")
    return (
        f"The board deflects by {ratio:.2g} times its thickness. Small kinematics leave out the strain that goes with"
        f" its rotation, up to {1e6 * left_out:.0f} µm/m; the largest board strain under the package is {strain}."
        ' A real board stiffens and deflects less: shock.numerics.kinematics = "finite" takes that into account.'
    )


def ranking_mode(histories: dict, results: dict) -> str:
    """Return the mode in which all joints are fine, unless that ended early."""
    main = next(iter(histories))
    is_whole = "dns" in results and len(histories["dns"]["time"]) == len(histories[main]["time"])
    return "dns" if is_whole and findings.fine_joints_of(results[main]) else main


def _add_ranks(histories: dict, results: dict, joints: list[dict], context: dict) -> None:
    """Rank the joints by ``ranking_mode``."""
    main, ranked = next(iter(histories)), ranking_mode(histories, results)
    whose = f"of the {tables.mode_name(ranked)}, whose joints are all fine"
    context["ranked_by"] = whose if ranked != main else ""
    result = results[ranked]
    context["tables"]["joints"] = joint_tables.ranked_joints(
        histories[ranked], joints, result["failure"], findings.fine_joints_of(result)
    )


def _add_shape_effect(shock: Path, history: dict, told: tuple[list[dict], dict], context: dict) -> None:
    """Add the shock of identical joints, where it was run; ``told`` of the real ones: records, and metrics of all."""
    from reflowshock.workflow.package_report import shape_effect

    histories, _ = read_modes(shock, ("identical",))
    if not histories:
        return
    (joints, metrics), identical = told, histories["identical"]
    context["shape_effect"] = shape_effect.in_words(history, identical)
    if "identical_joint_standoff" in metrics:
        real, flat = (micro(metrics[f"{name}_joint_standoff"]["value"]) for name in ("critical", "identical"))
        context["shape_effect"] += f" Its standoff is {real} µm, that of identical joints {flat} µm."
    context["curves"]["shape_effect"] = shape_effect.curves(history, identical)
    context["tables"]["shape_effect"] = shape_effect.table(history, identical, joints)


def _add_interface(shock: Path, context: dict) -> None:
    from reflowshock.workflow.package_report import interface

    interfaces = interface.read_interfaces(shock, MODES)
    if interfaces:
        context["curves"]["interface"] = interface.interface_maps(interfaces)
        context["tables"]["interface"] = interface.table(interfaces)


def _add_two_scales(run_folder: Path, case: BoardDropCase, context: dict, results: dict[str, dict]) -> None:
    """Add how the models are coupled, where they are."""
    from reflowshock.workflow.board_drop.fine_joints import read_fine_joints
    from reflowshock.workflow.board_drop.shock_forecast import implicit_seconds
    from reflowshock.workflow.report import two_scales as scales

    result = results.get("two_scale")
    if result is None:
        return
    coupling = result.get("coupling", {})
    fine = read_fine_joints(run_folder / "shock")
    context["tables"].update(
        two_scales=scales.two_scales(coupling, result["model"], fine.why if fine else ""),
        levels=scales.levels(coupling),
        placement=scales.placement(coupling),
    )
    seconds = implicit_seconds(case)
    search = run_folder / "shock/coarse/result.json"
    runs = [result, json.loads(search.read_text(encoding="utf-8"))] if search.exists() else [result]
    context["oracle"] = scales.oracle(seconds, runs) if seconds is not None else ""


def _add_pictures(folder: Path, history: dict, result: dict, context: dict) -> None:
    from reflowshock.workflow.report.pictures import embedded, render_board, render_joints

    whole = {name: path for name in ("dns", "macro", "meso") if (path := folder / f"{name}.pvd").exists()}
    is_one_way = result.get("coupling", {}).get("direction") == "one_way"
    joints, board = ([whole["meso"]], [whole["macro"]]) if is_one_way else 2 * (list(whole.values()),)
    parts = result["parts"]
    for name, render, series in (("joints", render_joints, joints), ("board", render_board, board)):
        draw = partial(render, series, history, parts)
        context["pictures"][name], context[f"{name}_caption"] = embedded(draw)
