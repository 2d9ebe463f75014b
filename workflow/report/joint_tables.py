"""Tables of joints: what the reflow made of each, how it was meshed, how the shock stressed it."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from workflow.products import read_json
from workflow.report.histories import at_pads
from workflow.report.tables import mega, micro, nano, number, percent

Record = Mapping[str, Any]
Column = tuple[str, str, Callable[[Any], str]]  # head, key of the record, text of its value

SHAPE_COLUMNS: tuple[Column, ...] = (
    ("standoff [µm]", "standoff", micro),
    ("max. width [µm]", "max_width", micro),
    ("angle board / package [deg]", "angles", str),
    ("tilt [mrad]", "tilted", lambda value: f"{1e3 * value:.2f}"),
    ("width error", "width_error", percent),
    ("axial force [mN]", "axial_force", lambda value: f"{1e3 * value:+.3f}"),
    ("volume drift", "volume_drift", percent),
)
MESH_COLUMNS: tuple[Column, ...] = (
    ("method", "method", str),
    ("volume error", "volume_error", percent),
    ("standoff error", "standoff_error", percent),
    ("contact area error", "contact_area_error", percent),
    ("largest deviation [µm]", "shape_deviation", micro),
    ("min. scaled Jacobian", "minimum_scaled_jacobian", lambda value: f"{value:.2f}"),
    ("critical step", "critical_time_step", nano),
    ("tries", "tries", number),
)
SMALLEST_OF = ("minimum_scaled_jacobian", "critical_time_step")


def joint_records(run_folder: Path) -> list[dict]:
    """Join pad table, reflow metrics, measures of the surface and mesh quality: one flat record a joint, SI units.

    A joint whose surface was given has no reflow; stages that have not run contribute nothing.
    """
    found = (
        read_json(run_folder / "reflow/joints.json"),
        _optional(run_folder / "surface/surfaces.json"),
        _optional(run_folder / "solder_mesh/quality.json"),
    )
    return [_record(pad, *found) for pad in read_json(run_folder / "reflow/pads.json")]


def _record(pad: Mapping, reflow: Mapping, surfaces: Mapping, quality: Mapping) -> dict:
    name = pad["name"]
    joint = reflow.get(name, {})
    shape = joint.get("shape", name)
    metrics = {key: metric["value"] for key, metric in joint.get("metrics", {}).items()}
    record = surfaces.get(name, surfaces.get(shape, {})) | pad | {"shape": shape} | metrics
    record |= {"verdict": joint.get("verdict", "given")} | quality.get(name, {})
    angles = (record.get("contact_angle_board"), record.get("contact_angle_package"))
    if None not in angles:
        record["angles"] = f"{angles[0]:.1f} / {angles[1]:.1f}"
    tilt = float(np.hypot(*pad.get("tilt", (0.0, 0.0))))
    return record | ({"tilted": tilt} if tilt else {})


def by_shape(joints: Sequence[Record]) -> list[tuple[list[str], list[Record]]]:
    """Return names and records of the joints of each distinct shape, by increasing standoff of the first of them."""
    groups: dict[str, list[Record]] = {}
    for joint in joints:
        groups.setdefault(joint["shape"], []).append(joint)
    ordered = sorted(groups.values(), key=lambda group: group[0]["standoff"])
    return [([joint["name"] for joint in group], group) for group in ordered]


def shapes(joints: Sequence[Record]) -> dict:
    """One row a distinct shape, by increasing standoff."""
    return _table(SHAPE_COLUMNS, by_shape(joints), lambda key, values: values[0])


def meshes(joints: Sequence[Record]) -> dict | None:
    """How the joints were meshed, the worst of each shape; None where none is."""
    if not any("minimum_scaled_jacobian" in joint for joint in joints):
        return None
    return _table(MESH_COLUMNS, by_shape(joints), _worst)


def _worst(key: str, values: list) -> Any:
    """Return the worst of the values of a column."""
    if isinstance(values[0], str):
        return " ".join(dict.fromkeys(values))
    return min(values) if key in SMALLEST_OF else max(values, key=abs)


def _table(columns: Iterable[Column], groups: list, chosen: Callable[[str, list], Any]) -> dict:
    """Return a table of the columns that any record has."""
    known = [column for column in columns if any(column[1] in joint for _, group in groups for joint in group)]
    rows = [[" ".join(names), *(_text(column, group, chosen) for column in known)] for names, group in groups]
    return {"head": ["joints", *(head for head, _, _ in known)], "rows": rows}


def _text(column: Column, group: Sequence[Record], chosen: Callable[[str, list], Any]) -> str:
    _, key, text = column
    values = [joint[key] for joint in group if key in joint]
    return text(chosen(key, values)) if values else "–"


def verdicts(run_folder: Path) -> dict:
    """Verdict of the reflow on every joint, those that are not ok first."""
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
    return {"head": ["joint", "verdict", "touches", "standoff [µm]", "max. width alone [µm]"], "rows": rows}


def ranked_joints(
    history: Mapping[str, np.ndarray],
    joints: Sequence[Record],
    failure: Mapping[str, dict],
    fine: Collection[str] | None = None,
) -> dict:
    """Joints ranked by peak von Mises stress at their pads.

    Args:
        history: of one mode.
        joints: ``joint_records``.
        failure: criterion -> joint -> value, limit, ok; of the same mode.
        fine: names of the fine joints, where some are coarse.
    """
    shape = {joint["name"]: joint for joint in joints}
    stress = at_pads(history)
    peel = np.maximum(history["peel_board"], history["peel_package"])
    rows = []
    for column in np.argsort(-stress.max(axis=0)):
        name, row = str(history["joints"][column]), int(np.argmax(stress[:, column]))
        side = "board" if history["von_mises_board"][row, column] == stress[row, column] else "package"
        rows.append(
            [
                name,
                mega(stress[row, column]),
                side,
                f"{1e3 * history['time'][row]:.3f}",
                mega(peel[:, column].max()),
                mega(history["von_mises_max"][:, column].max()),
                micro(shape[name]["standoff"]),
                micro(shape[name]["max_width"]),
                *failure_cells(history, column, failure),
                *([] if fine is None else ["fine" if name in fine else "coarse"]),
            ]
        )
    head = [
        "joint",
        "von Mises at pad [MPa]",
        "pad",
        "time [ms]",
        "peel stress [MPa]",
        "largest in an element [MPa]",
        "standoff [µm]",
        "width [µm]",
        *(["plastic work at pad [kJ/m³]"] if "plastic_work_board" in history else []),
        *(["fails by"] if failure else []),
        *([] if fine is None else ["mesh"]),
    ]
    return {"head": head, "rows": rows}


def failure_cells(history: Mapping[str, np.ndarray], column: int, failure: Mapping[str, dict]) -> list[str]:
    """Plastic work and failed criteria of the joint in a column of the history: only what the run has."""
    cells = []
    if "plastic_work_board" in history:
        work = max(history[f"plastic_work_{end}"][:, column].max() for end in ("board", "package"))
        cells.append(number(1e-3 * work))
    if failure:
        joint = str(history["joints"][column])
        failed = [name.replace("_", " ") for name, verdicts in failure.items() if not verdicts[joint]["ok"]]
        cells.append(", ".join(failed) or "–")
    return cells


def _optional(path: Path) -> dict:
    return read_json(path) if path.exists() else {}
