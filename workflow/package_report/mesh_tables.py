"""Tables of joint meshes: what they keep of the surfaces, their quality, and what earlier tries missed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from reflowshock.workflow.case.text import micro, nano, number, percent
from reflowshock.workflow.package_report.joint_records import Column, Record, by_shape, record_table
from reflowshock.workflow.process.products import read_json

MESH_COLUMNS: tuple[Column, ...] = (
    ("method", "method", str),
    ("volume error", "volume_error", percent),
    ("standoff error", "standoff_error", percent),
    ("contact area error", "contact_area_error", percent),
    ("largest deviation [µm]", "shape_deviation", micro),
    ("min. scaled Jacobian", "minimum_scaled_jacobian", lambda value: f"{value:.2f}"),
    ("critical step", "critical_time_step", nano),
    ("tetrahedra", "tetrahedra", number),
    ("their scaled Jacobian", "tetrahedra_quality", lambda value: f"{value:.2f}"),
    ("tries", "tries", number),
)
SMALLEST_OF = ("minimum_scaled_jacobian", "critical_time_step", "tetrahedra_quality")


def meshes(joints: Sequence[Record]) -> dict | None:
    """How the joints were meshed, the worst of each shape; None where none is."""
    if not any("minimum_scaled_jacobian" in joint for joint in joints):
        return None
    return record_table(MESH_COLUMNS, by_shape([_counted(joint) for joint in joints]), _worst)


def missed_tries(joints: Sequence[Record]) -> dict | None:
    """What tries to mesh a joint have missed before one succeeded; None where none has."""
    rows = [[joint["name"], way["method"], way["missed"]] for joint in joints for way in joint.get("tries", ())]
    return {"head": ["joint", "method", "missed"], "rows": rows, "prose": True} if rows else None


def fine_instead(run_folder: Path) -> dict | None:
    """Why joints of which few hexahedra cannot follow the shape are as fine where they were to be coarse."""
    path = run_folder / "solder_mesh/coarse_quality.json"
    coarse = read_json(path) if path.exists() else {}
    rows = [[name, joint["fine_instead"]] for name, joint in coarse.items() if "fine_instead" in joint]
    return {"head": ["joint", "why"], "rows": rows, "prose": True} if rows else None


def _counted(joint: Record) -> dict[str, Any]:
    """Return a record with the number of its tries, and of the tetrahedra that its hexahedra were made of."""
    counted = dict(joint)
    if "tries" in joint:
        counted["tries"] = len(joint["tries"]) + 1
    if tetrahedra := joint.get("tetrahedra"):
        counted |= {"tetrahedra": tetrahedra["count"], "tetrahedra_quality": tetrahedra["minimum_scaled_jacobian"]}
    return counted


def _worst(key: str, values: list) -> Any:
    """Return the worst of the values of a column."""
    if isinstance(values[0], str):
        return " ".join(dict.fromkeys(values))
    return min(values) if key in SMALLEST_OF else max(values, key=abs)
