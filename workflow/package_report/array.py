"""Joint shapes of an array after reflow: surfaces in 3D and maps of the array."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.meshing.surface.truncated_sphere import TruncatedSphere
from reflowshock.workflow.package_report.joint_records import by_shape
from reflowshock.workflow.report.colours import colour_at, ink_on
from reflowshock.workflow.report.scene import MOST_TRIANGLES, Field, Group, Scene, decimate

MICRO, MILLI = 1e-6, 1e-3
MAPS = (
    ("standoff", "standoff", "µm", MICRO),
    ("max_width", "maximum width", "µm", MICRO),
    ("contact_angle_package", "contact angle at the package pad", "deg", 1.0),
    ("tilted", "tilt of the package pad", "mrad", MILLI),
    ("contact_angle_board", "contact angle at the board pad", "deg", 1.0),
)
PANELS = 4
FREE = 0
DEVIATION = "deviation from the truncated sphere"
VIEW = (-0.5, -1.6, 0.7)


def shapes_scene(run_folder: Path, joints: Sequence[Mapping[str, Any]]) -> Scene:
    """Return all joints in the array, coloured by their distance from the truncated sphere of equal volume.

    Args:
        run_folder: Folder of the run; without closed surfaces the shapes of the reflow are shown.
        joints: Records of the joints with ``name``, ``shape`` and measures in SI units, see ``joint_records``.

    Returns:
        Interactive 3D scene for the report page.
    """
    kinds: dict[str, list[Group]] = {}
    limit = 0.0
    for _, group in by_shape(joints):
        points, triangles, is_free = joint_surface(run_folder, group[0])
        distance = deviation(points, group[0]) / MICRO
        limit = max(limit, float(np.abs(distance[np.unique(triangles[is_free])]).max()))
        part = np.zeros(len(points), int)
        free = Group("solder", points, triangles[is_free], part, values={DEVIATION: distance[None]})
        wetted = Group("wetted discs", points, triangles[~is_free], part, "#8a949e")
        for surface in decimate([free, wetted], MOST_TRIANGLES // len(joints)):
            placed = [_at(surface, joint, joints.index(joint)) for joint in group if len(surface.faces)]
            kinds.setdefault(surface.name, []).extend(placed)
    joined = [_joined(groups) for groups in kinds.values() if groups]
    fields = [Field(DEVIATION, "µm", -limit, limit, "diverging")]
    return Scene(joined, [f"solder@{joint['name']}" for joint in joints], fields, view=VIEW)


def joint_surface(run_folder: Path, joint: Mapping[str, Any]) -> tuple[Floats, NDArray[np.integer], NDArray[np.bool_]]:
    """Read the closed surface of a joint; without one, its free surface after reflow.

    Args:
        run_folder: Run folder with the products of reflow and surface.
        joint: Record of the joint with its ``name`` and ``shape``, see ``joint_records``.

    Returns:
        Points, shape (n, 3) [m]; triangles, shape (t, 3); whether each triangle is on the free surface, shape (t,).
    """
    for name in (joint["name"], joint["shape"]):
        path = run_folder / f"surface/{name}.vtu"
        if path.exists():
            import meshio

            mesh = meshio.read(path)
            return mesh.points, mesh.cells_dict["triangle"], mesh.cell_data_dict["boundary"]["triangle"] == FREE
    from reflowshock.particles.scenes.products import read_shapes

    shape = read_shapes(run_folder / "reflow/shapes.h5")[joint["shape"]]
    return shape.surface_points, shape.triangles, np.ones(len(shape.triangles), dtype=bool)


def deviation(points: Floats, joint: Mapping[str, Any]) -> Floats:
    """Return the signed distance of points from the truncated sphere of a joint's volume and pads.

    Args:
        points: Points in the frame of the joint, shape (n, 3) [m].
        joint: Record with ``volume`` [m^3], ``wetted_radius_board`` and ``wetted_radius_package`` [m].

    Returns:
        Distances, positive outside, shape (n,) [m].
    """
    discs = joint["wetted_radius_board"], joint["wetted_radius_package"]
    return TruncatedSphere.of_volume(joint["volume"], *discs).signed_distance(np.asarray(points, dtype=float))


def _at(group: Group, joint: Mapping[str, Any], number: int) -> Group:
    """Return a joint's surface moved to its position in the array."""
    position = np.array([joint["x"], joint["y"], 0.0])
    part = np.full(len(group.points), number)
    return replace(group, points=group.points + position, part=part)


def _joined(groups: Sequence[Group]) -> Group:
    """Merge groups of triangles into one."""
    first = np.cumsum([0, *(len(group.points) for group in groups)])
    return Group(
        groups[0].name,
        np.concatenate([group.points for group in groups]),
        np.concatenate([group.faces + start for group, start in zip(groups, first, strict=False)]),
        np.concatenate([group.part for group in groups]),
        colour=groups[0].colour,
        values={name: np.concatenate([group.values[name] for group in groups], axis=1) for name in groups[0].values},
    )


@dataclass(frozen=True, slots=True)
class Map:
    """A map of one quantity over the array.

    Attributes:
        label: Quantity and unit.
        cells: Position x and y (downwards) in pitches, colour, text colour, name, text and verdict of each joint.
        size: Width and height in pitches.
        scale: Text and colour of the ticks of the colour scale, the largest value first.
    """

    label: str
    cells: list[dict[str, Any]]
    size: tuple[float, float]
    scale: list[tuple[str, str]]


def array_maps(joints: Sequence[Mapping[str, Any]]) -> list[Map]:
    """Return up to four maps of the array of joints, one for each quantity that the joints have.

    Args:
        joints: Records with name, x, y [m] and any of ``standoff``, ``max_width`` [m], ``contact_angle_package``,
            ``contact_angle_board`` [deg] and ``tilted`` [rad], see ``joint_records``.

    Returns:
        Maps with one coloured cell per joint and a colour scale; quantities without values have no map.
    """
    available = [entry for entry in MAPS if any(entry[0] in joint for joint in joints)][:PANELS]
    return [_map(joints, *entry) for entry in available]


def pitch_of(joints: Sequence[Mapping[str, Any]]) -> float:
    """Return the smallest distance between two joints along x or y [m]; 1 mm for a single joint.

    Args:
        joints: Records with ``x`` and ``y`` [m].
    """
    steps = [np.diff(np.unique(np.round([joint[axis] for joint in joints], 9))) for axis in ("x", "y")]
    return float(min(np.concatenate(steps), default=MILLI))


def _map(joints: Sequence[Mapping[str, Any]], key: str, label: str, unit: str, factor: float) -> Map:
    values = np.array([joint.get(key, 0.0) for joint in joints]) / factor
    x, y = (np.array([joint[name] for joint in joints]) / pitch_of(joints) for name in "xy")
    low, high = float(values.min()), float(values.max())
    digits = 0 if np.abs(values).max() >= 100.0 else 1 if np.abs(values).max() >= 10.0 else 2
    cells = []
    for joint, right, up, value in zip(joints, x, y, values, strict=True):
        colour = colour_at((value - low) / ((high - low) or 1.0))
        is_ok = joint.get("verdict", "ok") in ("ok", "given")
        position = {"x": round(float(right - x.min()) + 0.5, 3), "y": round(float(y.max() - up) + 0.5, 3)}
        text = {"name": joint["name"], "text": f"{value:.{digits}f}", "full": f"{value:.4g} {unit}"}
        cells.append(position | text | {"colour": colour, "ink": ink_on(colour), "ok": is_ok})
    steps = np.linspace(high, low, 5 if high > low else 1)
    scale = [(f"{step:.4g}", colour_at((step - low) / ((high - low) or 1.0))) for step in steps]
    return Map(f"{label} [{unit}]", cells, (round(float(np.ptp(x)) + 1, 3), round(float(np.ptp(y)) + 1, 3)), scale)
