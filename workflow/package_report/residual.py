"""Residual stress of cooling, in which the shock begins: joints, picture, words."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from reflowshock.workflow.case.text import mega, micro, number, quantity
from reflowshock.workflow.process.products import read_json

FOLDERS = ("residual_two_scale", "residual_dns", "residual")  # of modes with fine joints of their own, or of all modes
SIDES = ("von_mises_board", "von_mises_package")


def add_residual(shock: Path, parts: list[str], context: dict) -> None:
    """Add what cooling left, where the shock begins with it.

    Args:
        shock: folder of the shock.
        parts: names of the parts of its mesh.
        context: of the page.
    """
    from reflowshock.workflow.report.pictures import embedded

    folder = next((shock / name for name in FOLDERS if (shock / name / "result.json").exists()), None)
    if folder is None:
        return
    result = read_json(folder / "result.json")
    context["residual"] = in_words(result["metrics"])
    context["tables"]["residual"] = table(result["joints"])
    if result["joints"]["joints"]:
        context["pictures"]["residual"], _ = embedded(partial(_draw, folder, result["joints"], parts))


def in_words(metrics: Mapping[str, Any]) -> str:
    """Say what stress cooling leaves in the joints, and how the package's warpage changes."""
    lifts = (metrics[name]["value"] for name in ("solidified_warpage", "room_temperature_warpage"))
    warped, cold = (f"{micro(lift)} µm" for lift in lifts)
    told = f"Cooling from solidification changes the warpage of the package from {warped} to {cold}"
    if "residual_stress_joint" in metrics:
        joint, stress = metrics["residual_stress_joint"]["value"], quantity(metrics["residual_stress_largest"])
        told += f" and leaves {stress} at the pads of {joint}, the largest of all joints"
    return f"{told}. The shock begins with it: an upper bound, since solder that relaxes afterwards is not modelled."


def table(joints: Mapping[str, list]) -> dict:
    """Stress of every joint before the shock, the largest first."""
    columns = [joints[name] for name in (*SIDES, "von_mises_max")]
    strains = joints.get("plastic_strain_max")
    heads = ["at the board's pad [MPa]", "at the package's pad [MPa]", "largest in an element [MPa]"]
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


def _draw(folder: Path, joints: Mapping[str, list], parts: list[str], picture: Path) -> None:
    import pyvista

    from reflowshock.workflow.report.pictures import draw_joints

    stress = [max(joints[side][k] for side in SIDES) for k in range(len(joints["joints"]))]
    worst = stress.index(max(stress))
    draw_joints(pyvista.read(folder / "residual.vtu"), parts, joints["joints"][worst], stress[worst], picture)
