"""Sections of the report on the shock of a package: stresses, what the shapes change, two scales, energies, cost."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reflowshock.fem.output.ranking import ranking_measure
from reflowshock.workflow.case.text import mega, micro, number, quantity
from reflowshock.workflow.package import findings
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.package.verdict import failing, limits_table
from reflowshock.workflow.package_report import joint_tables
from reflowshock.workflow.package_report.board import add_board
from reflowshock.workflow.package_report.headline import headline, later_swings
from reflowshock.workflow.package_report.joint_records import joint_records
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.report import tables
from reflowshock.workflow.report.histories import MODES, read_modes

FOLDERS = ("residual_two_scale", "residual_dns", "residual")  # of modes with fine joints of their own, or of all modes
SIDES = ("von_mises_board", "von_mises_package")


def add_shock(run_folder: Path, case: BoardDropCase, context: dict, summary: dict) -> None:
    """Add the sections on the shock, where it was run."""
    shock = run_folder / "shock"
    histories, results = read_modes(shock)
    if not histories:
        return
    from reflowshock.workflow.package_report import cost
    from reflowshock.workflow.package_report.scenes import drop_scene
    from reflowshock.workflow.report.curves import difference_curves, energy_curves, history_curves

    main = next(iter(histories))
    metrics = summary["metrics"]
    joints = joint_records(run_folder)
    critical = metrics["critical_joint"]["value"]
    context["headline"] = tables.headline(metrics) + context["headline"]
    context["figures"] = headline(metrics, context["discretisation"], summary, results)
    context["figures"]["note"] += later_swings(case.shock, float(histories[main]["time"][-1]))
    context |= {"verdict": summary["verdict"], "answer": summary["answer"]}
    context["failing"] = failing(summary["verdict"])
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
        limits=limits_table(case.shock.failure),
    )
    context["published_source"] = cost.PAPER
    add_board(shock, case, histories, metrics, context)
    _add_ranks(histories, results, (joints, summary["verdict"]["joints"]), context)
    _add_shape_effect(shock, histories[main], (joints, metrics), context)
    _add_interface(shock, context)
    add_residual(shock, results[main]["parts"], context)
    _add_two_scales(run_folder, case, context, results)
    context["scenes"]["view"], context["view_caption"] = drop_scene(shock / main, histories[main], results[main])


def kinematics_note(metrics: dict, kinematics: str) -> str:
    """Say what small kinematics leave out, where that matters; else nothing."""
    from reflowshock.fem.problem.kinematics import NEGLIGIBLE_STRAIN

    left_out = metrics.get("peak_neglected_strain", {}).get("value", 0.0)
    if kinematics != "small" or left_out <= NEGLIGIBLE_STRAIN:
        return ""
    ratio = metrics["deflection_over_thickness"]["value"]
    strain = tables.named_quantity(metrics, "peak_board_strain")
    return (
        f"The board deflects by {ratio:.3g} times its thickness. Small kinematics leave out the strain that goes with"
        f" its rotation, up to {1e6 * left_out:.0f} µm/m; the largest board strain under the package is {strain}."
        ' A real board stiffens and deflects less: shock.numerics.kinematics = "auto" takes that into account.'
    )


def ranking_mode(histories: dict, results: dict) -> str:
    """Return the mode in which all joints are fine, unless that ended early."""
    main = next(iter(histories))
    is_whole = "dns" in results and len(histories["dns"]["time"]) == len(histories[main]["time"])
    return "dns" if is_whole and findings.fine_joints_of(results[main]) else main


def _add_ranks(histories: dict, results: dict, joints: tuple[list[dict], dict], context: dict) -> None:
    """Rank the joints by ``ranking_mode``; ``joints`` are their records and their verdicts."""
    main, ranked = next(iter(histories)), ranking_mode(histories, results)
    whose = f" (of the {tables.mode_name(ranked)}, whose joints are all fine)" if ranked != main else ""
    context["joint_order"] = f"Largest {ranking_measure(histories[ranked]).name} first{whose}"
    result = results[ranked]
    context["tables"]["joints"] = joint_tables.ranked_joints(
        histories[ranked], *joints, findings.fine_joints_of(result)
    )


def _add_shape_effect(shock: Path, history: dict, text: tuple[list[dict], dict], context: dict) -> None:
    """Add the shock of identical joints, where it was run; ``text`` of the real ones: records, and metrics of all."""
    from reflowshock.workflow.package_report import shape_effect

    histories, _ = read_modes(shock, ("identical",))
    if not histories:
        return
    (joints, metrics), identical = text, histories["identical"]
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
        context["scenes"]["interface"] = interface.interface_scene(interfaces)
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


def add_residual(shock: Path, parts: list[str], context: dict) -> None:
    """Add what cooling left, where the shock begins with it.

    Args:
        shock: folder of the shock.
        parts: names of the parts of its mesh.
        context: of the page.
    """
    from reflowshock.workflow.package_report.scenes import residual_scene

    folder = next((shock / name for name in FOLDERS if (shock / name / "result.json").exists()), None)
    if folder is None:
        return
    result = read_json(folder / "result.json")
    context["residual"] = in_words(result["metrics"])
    context["tables"]["residual"] = table(result["joints"])
    if result["joints"]["joints"]:
        top = max(max(result["joints"][side]) for side in SIDES)
        context["scenes"]["residual"] = residual_scene(folder / "residual.vtu", parts, top)


def in_words(metrics: Mapping[str, Any]) -> str:
    """Say what stress cooling leaves in the joints, and how the package's warpage changes."""
    lifts = (metrics[name]["value"] for name in ("solidified_warpage", "room_temperature_warpage"))
    warped, cold = (f"{micro(lift)} µm" for lift in lifts)
    text = f"Cooling from solidification changes the warpage of the package from {warped} to {cold}"
    if "residual_stress_joint" in metrics:
        joint, stress = metrics["residual_stress_joint"]["value"], quantity(metrics["residual_stress_largest"])
        text += f" and leaves {stress} at the pads of {joint}, the largest of all joints"
    return f"{text}. The shock begins with it: an upper bound, since solder that relaxes afterwards is not modelled."


def table(joints: Mapping[str, list]) -> dict:
    """Stress of every joint before the shock, the largest first."""
    columns = [joints[name] for name in (*SIDES, "von_mises_max")]
    strains = joints.get("plastic_strain_max")
    heads = ["at the board's pad [MPa]", "at the package's pad [MPa]", "largest element value [MPa]"]
    order = sorted(range(len(joints["joints"])), key=lambda k: -max(joints[side][k] for side in SIDES))
    rows = [
        [
            joints["joints"][k],
            *(mega(column[k]) for column in columns),
            *([] if strains is None else [f"{number(100.0 * strains[k])} %"]),
        ]
        for k in order
    ]
    return {"head": ["joint", *heads, *([] if strains is None else ["largest plastic strain"])], "rows": rows}
