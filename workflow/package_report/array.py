"""Joints of an array as the reflow left them: their surfaces in 3D, and maps of the array."""

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
from reflowshock.workflow.report.scene import MOST_TRIANGLES, Field, Group, Scene, decimated

MICRO, MILLI = 1e-6, 1e-3
MAPS = (
    ("standoff", "standoff", "µm", MICRO),
    ("max_width", "maximum width", "µm", MICRO),
    ("contact_angle_package", "contact angle at the package", "deg", 1.0),
    ("tilted", "tilt of the package's pad", "mrad", MILLI),
    ("contact_angle_board", "contact angle at the board", "deg", 1.0),
)
PANELS = 4
FREE = 0
DEVIATION = "deviation from the truncated sphere"
VIEW = (-0.5, -1.6, 0.7)


def shapes_scene(run_folder: Path, joints: Sequence[Mapping[str, Any]]) -> Scene:
    """Return every joint at its place, coloured by its distance from the truncated sphere of its volume and discs.

    Args:
        run_folder: of the run, with closed surfaces or else the shapes of the reflow.
        joints: ``joint_records``.
    """
    kinds: dict[str, list[Group]] = {}
    limit = 0.0
    for _, alike in by_shape(joints):
        points, triangles, is_free = joint_surface(run_folder, alike[0])
        away = deviation(points, alike[0]) / MICRO
        limit = max(limit, float(np.abs(away[np.unique(triangles[is_free])]).max()))
        part = np.zeros(len(points), int)
        free = Group("solder", points, triangles[is_free], part, values={DEVIATION: away[None]})
        wetted = Group("wetted discs", points, triangles[~is_free], part, "#8a949e")
        for one in decimated([free, wetted], MOST_TRIANGLES // len(joints)):
            placed = [_at(one, joint, joints.index(joint)) for joint in alike if len(one.faces)]
            kinds.setdefault(one.name, []).extend(placed)
    shown = [_joined(groups) for groups in kinds.values() if groups]
    fields = [Field(DEVIATION, "µm", -limit, limit, "diverging")]
    return Scene(shown, [f"solder@{joint['name']}" for joint in joints], fields, view=VIEW)


def joint_surface(run_folder: Path, joint: Mapping[str, Any]) -> tuple[Floats, NDArray[np.integer], NDArray[np.bool_]]:
    """Read the closed surface of a joint, or where there is none its free surface as the reflow left it.

    Returns:
        Points ``(n, 3)`` [m], triangles ``(t, 3)``, and which of these are of the free surface ``(t,)``.
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
    """Return the signed distance ``(n,)`` [m] of points from the truncated sphere of a joint's volume and discs."""
    discs = joint["wetted_radius_board"], joint["wetted_radius_package"]
    return TruncatedSphere.of_volume(joint["volume"], *discs).signed_distance(np.asarray(points, dtype=float))


def _at(group: Group, joint: Mapping[str, Any], number: int) -> Group:
    """Return a joint's surface at its place in the array."""
    place = np.array([joint["x"], joint["y"], 0.0])
    part = np.full(len(group.points), number)
    return replace(group, points=group.points + place, part=part)


def _joined(groups: Sequence[Group]) -> Group:
    """Return groups of triangles as one."""
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
    """A map of the array: a quantity of every joint at its place.

    Attributes:
        label: what it shows, with its unit.
        cells: x and y in pitches, y downwards; colour, ink, name, text, and whether the verdict is ok; of each joint.
        size: width and height in pitches.
        scale: text and colour of some values, the largest first.
    """

    label: str
    cells: list[dict[str, Any]]
    size: tuple[float, float]
    scale: list[tuple[str, str]]


def array_maps(joints: Sequence[Mapping[str, Any]]) -> list[Map]:
    """Return maps of standoff, width, contact angle and tilt or second contact angle.

    Args:
        joints: records with name, x, y, standoff, max_width [m] and verdict, and what else of ``MAPS`` the joints have.
    """
    shown = [entry for entry in MAPS if any(entry[0] in joint for joint in joints)][:PANELS]
    return [_map(joints, *entry) for entry in shown]


def pitch_of(joints: Sequence[Mapping[str, Any]]) -> float:
    """Return the smallest distance of two joints along x or y [m]; 1 mm for a single one."""
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
        place = {"x": round(float(right - x.min()) + 0.5, 3), "y": round(float(y.max() - up) + 0.5, 3)}
        told = {"name": joint["name"], "text": f"{value:.{digits}f}", "full": f"{value:.4g} {unit}"}
        cells.append(place | told | {"colour": colour, "ink": ink_on(colour), "ok": is_ok})
    steps = np.linspace(high, low, 5 if high > low else 1)
    scale = [(f"{step:.4g}", colour_at((step - low) / ((high - low) or 1.0))) for step in steps]
    return Map(f"{label} [{unit}]", cells, (round(float(np.ptp(x)) + 1, 3), round(float(np.ptp(y)) + 1, 3)), scale)
