"""Report sections on the shock of a package: stresses, effect of joint shapes, two scales, energies, cost."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reflowshock.fem.output.ranking import ranking_measure
from reflowshock.workflow.case.text import mega, micro, number, quantity
from reflowshock.workflow.package import findings
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.package_report import joint_tables
from reflowshock.workflow.package_report.board import add_board
from reflowshock.workflow.package_report.headline import headline, later_swings
from reflowshock.workflow.package_report.joint_records import joint_records
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.report import tables
from reflowshock.workflow.report.histories import MODES, read_modes
from reflowshock.workflow.verdict.answer import criteria_table, failing

FOLDERS = ("residual_two_scale", "residual_dns", "residual")  # one mode each, or common to all modes
SIDES = ("von_mises_board", "von_mises_package")


def add_shock(run_folder: Path, case: BoardDropCase, context: dict, summary: dict) -> None:
    """Add the sections on the shock to the context of a report: headline, verdict, curves, tables and scenes.

    Args:
        run_folder: Run folder; without a history of the shock nothing is added.
        case: Case of the run.
        context: Context of the page's template, changed in place.
        summary: Content of ``summary.json`` with metrics, verdict and effects.
    """
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
    context["figures"]["note"] += later_swings(case.shock, float(histories[main]["time"][-1]), _end(run_folder))
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
        criteria=criteria_table(summary["verdict"]),
    )
    context["published_source"] = cost.PAPER
    add_board(shock, case, histories, metrics, context)
    ranked = ranking_mode(histories, results)
    context["joint_order"] = joint_order(histories[ranked], ranked if ranked != main else "")
    context["tables"]["joints"] = joint_tables.ranked_joints(
        histories[ranked], joints, summary["verdict"]["joints"], findings.fine_joints_of(results[ranked])
    )
    _add_shape_effect(shock, histories[main], joints, context)
    if context.get("shape_effect") and "identical_joint_standoff" in metrics:
        context["shape_effect"] += standoff_sentence(metrics)
    _add_interface(shock, context)
    add_residual(shock, results[main]["parts"], context)
    _add_two_scales(run_folder, case, context, results)
    context["scenes"]["view"], context["view_caption"] = drop_scene(shock / main, histories[main], results[main])


def kinematics_note(metrics: dict, kinematics: str) -> str:
    """Return a note on the strain that small kinematics neglect; empty where it is negligible.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``.
        kinematics: Kinematics of the run, "small" or "finite".
    """
    from reflowshock.fem.problem.kinematics import NEGLIGIBLE_STRAIN

    neglected = metrics.get("peak_neglected_strain", {}).get("value", 0.0)
    if kinematics != "small" or neglected <= NEGLIGIBLE_STRAIN:
        return ""
    ratio = metrics["deflection_over_thickness"]["value"]
    strain = tables.named_quantity(metrics, "peak_board_strain")
    return (
        f"The board deflects by {ratio:.3g} times its thickness. Small kinematics neglect the membrane strain of its"
        f" rotation, up to {1e6 * neglected:.0f} µm/m; the largest board strain under the package is {strain}."
        ' A real board stiffens and deflects less: use shock.numerics.kinematics = "auto".'
    )


def ranking_mode(histories: dict, results: dict) -> str:
    """Return the mode whose history ranks the joints.

    It is the DNS (one model with all joints fine) if the main run has coarse joints and the DNS lasted as long;
    otherwise the main mode.

    Args:
        histories: Mode -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity, the
            main mode first.
        results: Mode -> content of its ``result.json`` (``model``, ``metrics``, ``health``, ``timings``, ``coupling``).
    """
    main = next(iter(histories))
    is_whole = "dns" in results and len(histories["dns"]["time"]) == len(histories[main]["time"])
    return "dns" if is_whole and findings.fine_joints_of(results[main]) else main


def joint_order(history: dict, mode: str) -> str:
    """Return a sentence on how the joints are sorted.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity.
        mode: Mode of the history, which the sentence names; empty for the main mode, which is not named.
    """
    remark = f" (from the {tables.mode_name(mode)}, in which all joints are fine)" if mode else ""
    return f"Largest {ranking_measure(history).name} first{remark}"


def _add_shape_effect(shock: Path, history: dict, joints: list[dict], context: dict) -> None:
    """Compare the joints with identical ones, if their shock was run."""
    from reflowshock.workflow.package_report import shape_effect

    histories, _ = read_modes(shock, ("identical",))
    if not histories:
        return
    identical = histories["identical"]
    context["shape_effect"] = shape_effect.in_words(history, identical)
    context["curves"]["shape_effect"] = shape_effect.curves(history, identical)
    context["tables"]["shape_effect"] = shape_effect.table(history, identical, joints)


def standoff_sentence(metrics: Mapping[str, Any]) -> str:
    """Return a sentence with the standoff of the critical joint and of the identical joints.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``; ``critical_joint_standoff`` and
            ``identical_joint_standoff`` are read [m].
    """
    critical, identical = (micro(metrics[f"{name}_joint_standoff"]["value"]) for name in ("critical", "identical"))
    return f" Its standoff is {critical} µm; identical joints have {identical} µm."


def _end(run_folder: Path) -> str:
    """Return the reason for the end of the shock, if the coarse run decided it; else empty."""
    from reflowshock.workflow.board_drop.fine_joints import read_fine_joints

    fine = read_fine_joints(run_folder / "shock")
    return fine.end_why if fine else ""


def _add_interface(shock: Path, context: dict) -> None:
    from reflowshock.workflow.package_report import interface

    interfaces = interface.read_interfaces(shock, MODES)
    if interfaces:
        context["scenes"]["interface"] = interface.interface_scene(interfaces)
        context["tables"]["interface"] = interface.table(interfaces)


def _add_two_scales(run_folder: Path, case: BoardDropCase, context: dict, results: dict[str, dict]) -> None:
    """Add the tables on the coupling of the two models, if the two-scale run exists."""
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
    """Add the residual stress of cooling, if the shock starts with it.

    Args:
        shock: Folder of the shock, from which the first cooling is read; without one nothing is added.
        parts: Names of the parts of its mesh, in order.
        context: Context of the page's template, changed in place: ``residual``, ``tables``, ``scenes``.
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
    """Return sentences on the residual stress of the joints and the change of the package's warpage.

    Args:
        metrics: Name -> record with ``value`` (SI) and ``unit``, from ``result.json`` of the cooling.
    """
    warpages = (metrics[name]["value"] for name in ("solidified_warpage", "room_temperature_warpage"))
    hot, cold = (f"{micro(warpage)} µm" for warpage in warpages)
    text = f"Cooling from solidification changes the warpage of the package from {hot} to {cold}"
    if "residual_stress_joint" in metrics:
        joint, stress = metrics["residual_stress_joint"]["value"], quantity(metrics["residual_stress_largest"])
        text += f" and leaves {stress} at the pads of {joint}, the largest of all joints"
    return f"{text}. The shock starts from this stress; it is an upper bound, because creep of the solder is neglected."


def table(joints: Mapping[str, list]) -> dict:
    """Return the table of residual stress of every joint before the shock, the largest first.

    Args:
        joints: Entry ``joints`` of the cooling's ``result.json``: names in ``joints`` and, in the same order, lists of
            stresses [Pa] such as ``von_mises_board``, and optionally ``plastic_strain_max``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per joint: name, von Mises stress at
        the board pad, at the package pad and in an element [MPa], and largest plastic strain if it was stored.
    """
    columns = [joints[name] for name in (*SIDES, "von_mises_max")]
    strains = joints.get("plastic_strain_max")
    heads = ["board pad [MPa]", "package pad [MPa]", "largest element value [MPa]"]
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
