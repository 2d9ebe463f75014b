"""Tables of joints: shape after reflow, mesh quality, stress in the shock."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from reflowshock.fem.output.ranking import (
    ENDS,
    OUTER_FIBRE,
    PEEL,
    PLASTIC_WORK,
    VON_MISES,
    rank_joints,
    ranking_measure,
)
from reflowshock.workflow.case.text import mega, micro, nano, number, percent
from reflowshock.workflow.package_report.joint_records import Column, Record, by_shape, record_table
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.verdict.criteria import BY_NAME

MESH_COLUMNS: tuple[Column, ...] = (
    ("method", "method", str),
    ("volume error", "volume_error", percent),
    ("standoff error", "standoff_error", percent),
    ("contact area error", "contact_area_error", percent),
    ("largest deviation [µm]", "shape_deviation", micro),
    ("min. scaled Jacobian", "minimum_scaled_jacobian", lambda value: f"{value:.2f}"),
    ("critical time step", "critical_time_step", nano),
    ("tetrahedra", "tetrahedra", number),
    ("min. scaled Jacobian of tetrahedra", "tetrahedra_quality", lambda value: f"{value:.2f}"),
    ("attempts", "tries", number),
)
SMALLEST_OF = ("minimum_scaled_jacobian", "critical_time_step", "tetrahedra_quality")


SHAPE_COLUMNS: tuple[Column, ...] = (
    ("standoff [µm]", "standoff", micro),
    ("max. width [µm]", "max_width", micro),
    ("contact angle board / package [deg]", "angles", str),
    ("tilt [mrad]", "tilted", lambda value: f"{1e3 * value:.2f}"),
    ("width error", "width_error", percent),
    ("upward force on the package [mN]", "axial_force", lambda value: f"{1e3 * value:+.3f}"),
    ("volume drift", "volume_drift", percent),
    ("smoothing loss", "smoothing_loss", percent),
    ("viscous loss", "viscous_loss", percent),
    ("energy imbalance", "energy_imbalance", percent),
)


def shapes(joints: Sequence[Record]) -> dict:
    """Return the table of distinct joint shapes, by increasing standoff.

    Args:
        joints: Records of the joints with ``name``, ``shape`` and measures in SI units, see ``joint_records``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per shape: joints, and the measures
        that exist, such as standoff, width, contact angles, tilt, axial force and volume drift.
    """
    return record_table(SHAPE_COLUMNS, by_shape(joints), lambda key, values: values[0])


def verdicts(run_folder: Path) -> dict:
    """Return the table of reflow verdicts, joints that are not ok first.

    Args:
        run_folder: Run folder, of which ``reflow/joints.json`` is read.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per joint: name, verdict, joints that
        it touches, standoff and largest width [µm].
    """
    joints = read_json(run_folder / "reflow/joints.json")
    rows = [
        [
            name,
            joint["verdict"],
            " ".join(joint.get("touches", ())) or "–",
            micro(joint["metrics"]["standoff"]["value"]),
            micro(joint["metrics"]["max_width"]["value"]),
        ]
        for name, joint in sorted(joints.items(), key=lambda item: item[1]["verdict"] == "ok")
    ]
    return {"head": ["joint", "verdict", "touches", "standoff [µm]", "max. width without bridge [µm]"], "rows": rows}


def ranked_joints(
    history: Mapping[str, np.ndarray],
    joints: Sequence[Record],
    judged: Mapping[str, dict],
    fine: Collection[str] | None = None,
) -> dict:
    """Return the table of joints ranked by peel stress, or by plastic work if the solder yields.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity
            with one column per joint.
        joints: Records of the joints with ``name``, ``shape`` and measures in SI units, see ``joint_records``.
        judged: Name of a joint -> record with ``verdict``, ``margin`` (None without a limit) and ``criterion``.
        fine: Names of the fine joints; None if all are fine.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per joint, the most stressed first:
        name, verdict, margin, peak stresses, plastic work if any, worse pad, time of the peak, section force and
        moment, standoff and width.
    """
    shape = {joint["name"]: joint for joint in joints}
    measure = ranking_measure(history)
    rows = []
    for column in rank_joints(history):
        name = str(history["joints"][column])
        forces = np.stack([history[f"section_{end}"][:, column] for end in ENDS])
        row = int(np.argmax(PEEL.worse(history)[:, column]))
        rows.append(
            [
                name,
                *verdict_cells(judged[name]),
                mega(PEEL.peaks(history)[column]),
                mega(VON_MISES.peaks(history)[column]),
                *work_cells(history, column),
                measure.worse_end(history, column),
                f"{1e3 * history['time'][row]:.3f}",
                number(float(forces[..., 0].max())),
                number(float(1e3 * np.hypot(forces[..., 4], forces[..., 5]).max())),
                mega(OUTER_FIBRE.peaks(history)[column]),
                micro(shape[name]["standoff"]),
                micro(shape[name]["max_width"]),
                *([] if fine is None else ["fine" if name in fine else "coarse"]),
                mega(history["von_mises_max"][:, column].max()),
            ]
        )
    layer = f"{1e6 * float(history['joint_layer']):.4g} µm"
    head = [
        "joint",
        "verdict",
        "margin",
        "peel stress [MPa]",
        f"von Mises, {layer} layer at the pad [MPa]",
        *([f"plastic work, {layer} layer [kJ/m³]"] if "plastic_work_board" in history else []),
        "pad",
        "time of peel stress [ms]",
        "axial force [N]",
        "bending moment [N mm]",
        "outer-fibre stress [MPa]",
        "standoff [µm]",
        "width [µm]",
        *([] if fine is None else ["mesh"]),
        "largest element value [MPa] (mesh-dependent)",
    ]
    return {"head": head, "rows": rows}


def work_cells(history: Mapping[str, np.ndarray], column: int) -> list[str]:
    """Return the plastic work at the worse pad of a joint, as a list of one cell; empty if the solder is elastic.

    Args:
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity.
        column: Column of the joint in the history.
    """
    if "plastic_work_board" not in history:
        return []
    return [number(1e-3 * float(PLASTIC_WORK.peaks(history)[column]))]


def verdict_cells(judged: Mapping[str, Any]) -> list[str]:
    """Return verdict and smallest margin of a joint, with its criterion, as two texts.

    Args:
        judged: Record with ``verdict``, ``margin`` (None without a limit) and ``criterion``.
    """
    if judged["margin"] is None:
        return [judged["verdict"], "–"]
    return [judged["verdict"], f"{judged['margin']:.3g} by {BY_NAME[judged['criterion']].words}"]


def meshes(joints: Sequence[Record]) -> dict | None:
    """Return the table of mesh quality, the worst of each shape; None before the joints are meshed.

    Args:
        joints: Records of the joints with ``name``, ``shape`` and measures in SI units, see ``joint_records``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per shape: meshing method, errors of
        volume, standoff and contact area, smallest scaled Jacobian, critical time step and others that exist. None
        before the joints are meshed.
    """
    if not any("minimum_scaled_jacobian" in joint for joint in joints):
        return None
    return record_table(MESH_COLUMNS, by_shape([_counted(joint) for joint in joints]), _worst)


def missed_tries(joints: Sequence[Record]) -> dict | None:
    """Return the table of failed meshing attempts; None if every first attempt succeeded.

    Args:
        joints: Records of the joints with ``name``, ``shape`` and measures in SI units, see ``joint_records``;
            ``tries`` lists the failed attempts.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per failed attempt: joint, method and
        unmet criterion; None without failed attempts.
    """
    rows = [
        [joint["name"], attempt["method"], attempt["missed"]] for joint in joints for attempt in joint.get("tries", ())
    ]
    return {"head": ["joint", "method", "unmet criterion"], "rows": rows, "prose": True} if rows else None


def fine_instead(run_folder: Path) -> dict | None:
    """Return the table of joints that stay fine because a coarse mesh cannot follow their shape; None without any.

    Args:
        run_folder: Run folder, of which ``solder_mesh/coarse_quality.json`` is read if it exists.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): joint and reason; None without such joints.
    """
    path = run_folder / "solder_mesh/coarse_quality.json"
    coarse = read_json(path) if path.exists() else {}
    rows = [[name, joint["fine_instead"]] for name, joint in coarse.items() if "fine_instead" in joint]
    return {"head": ["joint", "reason"], "rows": rows, "prose": True} if rows else None


def _counted(joint: Record) -> dict[str, Any]:
    """Return a record with the number of meshing attempts and of the tetrahedra split into hexahedra."""
    counted = dict(joint)
    if "tries" in joint:
        counted["tries"] = len(joint["tries"]) + 1
    if tetrahedra := joint.get("tetrahedra"):
        counted |= {"tetrahedra": tetrahedra["count"], "tetrahedra_quality": tetrahedra["minimum_scaled_jacobian"]}
    return counted


def _worst(key: str, values: list) -> Any:
    """Return the worst value of a column, or all texts."""
    if isinstance(values[0], str):
        return " ".join(dict.fromkeys(values))
    return min(values) if key in SMALLEST_OF else max(values, key=abs)
