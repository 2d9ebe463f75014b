"""Report section on the joints: shapes after reflow, verdicts, meshes, warpage."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reflowshock.workflow.package_report import joint_tables
from reflowshock.workflow.package_report import joint_tables as mesh_tables
from reflowshock.workflow.package_report.joint_records import bridge_records, joint_records
from reflowshock.workflow.process.products import read_json

BRIDGE_CAPTION = "bridged: particles and free surface; the last frame is coloured by pressure above ambient."


def add_joints(run_folder: Path, context: dict) -> None:
    """Add shapes, maps, verdicts and meshes of all joints to the context of a report, as far as the run has gone.

    Args:
        run_folder: Run folder; without ``reflow/joints.json`` nothing is added.
        context: Context of the page's template, changed in place: ``headline``, ``tables``, ``maps``, ``scenes``,
            ``curves``, ``warpage``.
    """
    if not (run_folder / "reflow/joints.json").exists():
        return
    from reflowshock.workflow.package_report.array import array_maps, shapes_scene

    joints = joint_records(run_folder)
    meshed = joints + bridge_records(run_folder)
    context["headline"] += headline(joints)
    context["tables"] |= {
        "verdicts": joint_tables.verdicts(run_folder),
        "shapes": joint_tables.shapes(joints),
        "meshes": mesh_tables.meshes(meshed),
        "missed_tries": mesh_tables.missed_tries(meshed),
        "fine_instead": mesh_tables.fine_instead(run_folder),
    }
    context["maps"] = array_maps(joints)
    drawn = [joint for joint in joints if "given" not in joint or (run_folder / "surface").exists()]
    if drawn:
        context["scenes"]["shapes"] = shapes_scene(run_folder, drawn)
    _add_bridge(run_folder, context)
    _add_warpage(run_folder, joints, context)


def headline(joints: Sequence[Mapping[str, Any]]) -> list[dict]:
    """Return the figures of the joints at the top of the page: range of standoffs, numbers of joints and of shapes.

    Args:
        joints: Records of the joints with ``name``, ``shape`` and measures in SI units, see ``joint_records``; at least
            one.

    Returns:
        Two records with ``value`` and ``label`` as text.
    """
    standoffs = sorted({f"{1e6 * joint['standoff']:.0f}" for joint in joints}, key=float)
    shapes = len({joint["shape"] for joint in joints})
    return [
        {"value": f"{'–'.join(dict.fromkeys((standoffs[0], standoffs[-1])))} µm", "label": "standoff over the array"},
        {"value": f"{len(joints)} / {shapes}", "label": "joints / distinct shapes"},
    ]


def _add_bridge(run_folder: Path, context: dict) -> None:
    """Add a scene of the first bridged pair of joints, whose shape has two names joined by "+"."""
    if not any(joint["verdict"] == "bridged" for joint in read_json(run_folder / "reflow/joints.json").values()):
        return
    from reflowshock.particles.scenes.products import read_shapes
    from reflowshock.workflow.report.particles import particle_scene

    for name, shape in read_shapes(run_folder / "reflow/shapes.h5").items():
        if "+" in name:
            context["bridge_caption"] = f"{name} {BRIDGE_CAPTION}"
            context["scenes"]["bridge"] = particle_scene(shape)
            return


def _add_warpage(run_folder: Path, joints: Sequence[Mapping[str, Any]], context: dict) -> None:
    """Add the warpage of package and board, if the reflow computed it."""
    from reflowshock.workflow.package_report import warpage

    structure = warpage.read_structure(run_folder)
    if structure is None:
        return
    context["warpage"] = warpage.in_words(structure)
    context["scenes"]["warpage"] = warpage.warpage_scene(structure, joints)
    context["curves"]["profiles"] = warpage.profiles(structure)
    context["tables"]["load_steps"] = warpage.load_steps(structure)
