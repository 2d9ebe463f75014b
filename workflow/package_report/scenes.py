"""3D scenes of a package: joints, board and package in the shock, and residual stress before it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from reflowshock.fem.output.ranking import VON_MISES, Arrays, critical_joint
from reflowshock.workflow.report.bodies import body_group, exaggeration, milliseconds
from reflowshock.workflow.report.field_series import FieldSeries
from reflowshock.workflow.report.scene import Field, Group, Scene

MEGA, MILLI = 1e6, 1e-3
JOINT_HEIGHTS = 4.0  # length scale of drawn displacements, in heights of a joint
STRESS, PLASTIC, LIFT = "von Mises stress", "plastic strain", "displacement along z"
ROLES = ("solder", "copper", "board", "substrate", "die")
GHOSTS = ("board", "substrate", "die", "other packages")
OTHERS = "other packages"
VIEW = (1.5, 1.15, 0.75)  # from the package's corner
CELL_FIELDS = ("part", "von_mises", "plastic_strain")


def drop_scene(folder: Path, history: Arrays, result: Mapping[str, Any]) -> tuple[Scene, str]:
    """Return joints, board and package at all stored times of a shock, and a caption.

    Args:
        folder: Folder of the mode, whose field files are read.
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity.
        result: Content of ``result.json`` of the mode.

    Returns:
        Interactive 3D scene for the report page, one frame per stored time, and its caption.
    """
    stress = VON_MISES.worse(history)
    critical = stress[:, critical_joint(history)]
    time = float(history["time"][np.argmax(critical)])
    series = [FieldSeries.read(paths, CELL_FIELDS, time) for paths in _models(folder, result)]
    joints, whole = series[0], series[-1].at(series[0].times)
    scene = _scene(joints, whole, result["parts"], float(stress.max()), time)
    return scene, (
        "The stress scale ends at the largest average over a solder layer; single elements exceed it, and more so on"
        " finer meshes. Displacements are relative to the drop table."
    )


def residual_scene(path: Path, parts: Sequence[str], top: float) -> Scene:
    """Return the residual stress before the shock on a colour scale up to ``top``.

    Args:
        path: Field file ``residual.vtu``.
        parts: Names of the parts of the mesh, in the order of their numbers in the file.
        top: Largest stress of the colour scale [Pa].

    Returns:
        Interactive 3D scene for the report page.
    """
    import meshio

    mesh = meshio.read(path)
    cells = mesh.cells_dict["hexahedron"].astype(np.int64)
    fields = {name: mesh.cell_data_dict[name]["hexahedron"][None] for name in CELL_FIELDS if name in mesh.cell_data}
    moved = mesh.point_data["displacement"][None]
    series = FieldSeries(mesh.points, cells, np.zeros(1), moved, fields)
    return _scene(series, series, parts, top, 0.0)


def is_neighbour(part: str) -> bool:
    """Return whether a part ``<role>_<name>`` belongs to a neighbouring package, whose joints are not meshed."""
    return part.startswith(("solder_", "substrate_", "die_")) and "@" not in part


def _models(folder: Path, result: Mapping[str, Any]) -> list[list[Path]]:
    """Return the files of the models with the joints, then of the models with the board."""
    whole = {name: path for name in ("dns", "macro", "meso") if (path := folder / f"{name}.pvd").exists()}
    if result.get("coupling", {}).get("direction") == "one_way":
        return [[whole["meso"]], [whole["macro"]]]
    return [list(whole.values())]


def _scene(joints: FieldSeries, whole: FieldSeries, parts: Sequence[str], top: float, time: float) -> Scene:
    groups = []
    for role in (*ROLES, OTHERS):
        series = whole if role == "board" else joints
        numbers = [k for k, name in enumerate(parts) if role_of(name) == role]
        chosen = np.isin(series.fields["part"][0].astype(int), numbers)
        if chosen.any():
            style = {"is_ghost": role in GHOSTS}
            groups.append(body_group(role, series, chosen, _coloured_by(role, series), **style))
    return Scene(
        groups,
        parts,
        _fields(groups, top),
        milliseconds(joints.times) if len(joints.times) > 1 else [""],
        start=joints.nearest(time),
        exaggeration=_exaggeration(groups[0]),
        view=VIEW,
    )


def role_of(part: str) -> str:
    """Return the group of a part for the legend: its material role, or ``other packages`` for neighbouring packages."""
    return OTHERS if is_neighbour(part) else next((role for role in ROLES if part.startswith(role)), OTHERS)


def _coloured_by(role: str, series: FieldSeries) -> dict[str, np.ndarray]:
    """Return the fields that colour solder and copper; empty for other roles."""
    if role not in ("solder", "copper"):
        return {}
    fields = {STRESS: series.fields["von_mises"] / MEGA}
    if "plastic_strain" in series.fields:
        fields[PLASTIC] = 100.0 * series.fields["plastic_strain"]
    return fields


def _fields(groups: Sequence[Group], top: float) -> list[Field]:
    fields = [Field(STRESS, "MPa", 0.0, top / MEGA)]
    largest = max((float(group.values[PLASTIC].max()) for group in groups if PLASTIC in group.values), default=0.0)
    if largest > 0.0:
        fields.append(Field(PLASTIC, "%", 0.0, largest))
    lift = max(float(np.abs(group.displacement[:, :, 2]).max()) for group in groups if group.displacement is not None)
    if lift > 0.0:
        unit, factor = ("mm", 1 / MILLI) if lift > 0.1 * MILLI else ("µm", 1e6)
        fields.append(Field(LIFT, unit, -lift * factor, lift * factor, "diverging", "lift", factor))
    return fields


def _exaggeration(joints: Group) -> float:
    """Return the scale factor of displacements at which differences between joints are visible."""
    if joints.displacement is None:
        return 1.0
    differs = float(np.ptp(joints.displacement[:, :, 2], axis=1).max())
    return exaggeration(JOINT_HEIGHTS * float(np.ptp(joints.points[:, 2])), differs)
