"""Pictures of all joints: the gallery of distinct shapes at one scale, and maps of the array."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
from matplotlib import colormaps, pyplot
from matplotlib.axes import Axes

from reflowshock.meshing.surface.truncated_sphere import TruncatedSphere
from reflowshock.workflow.package_report.joint_records import by_shape
from reflowshock.workflow.report.curves import MICRO, MILLI, STYLE, svg
from reflowshock.workflow.report.pictures import new_plotter, save

MAPS = (
    ("standoff", "standoff [µm]", MICRO),
    ("max_width", "maximum width [µm]", MICRO),
    ("contact_angle_package", "contact angle at the package [deg]", 1.0),
    ("tilted", "tilt of the package's pad [mrad]", MILLI),
    ("contact_angle_board", "contact angle at the board [deg]", 1.0),
)
PANELS = 4
MAP_POINTS = 215.0  # width of a map on the page, in points
MARK_SHARE = 0.82  # of the pitch that a mark takes
SMALLEST_TEXT = 3.5  # points; below it a map has colours only
NOT_OK = "#b3261e"


FREE, WIDTH = 0, 1800
DEVIATION = "deviation [µm]"
LINES, LINE = 6, 31  # of text beneath a joint; pixels of one
BAR = 100  # pixels beneath all rows
MAXIMUM_NAMES = 4
TILT = 0.14  # of the view, from above


def render_gallery(run_folder: Path, joints: Sequence[Mapping[str, Any]], picture: Path) -> None:
    """Render every distinct joint shape in rows, by increasing standoff, from one side and at one scale.

    Args:
        run_folder: of the run, with closed surfaces or else the shapes of the reflow.
        joints: ``joint_records``.
        picture: PNG file to write.
    """
    groups = by_shape(joints)
    columns = min(len(groups), 5 if len(groups) <= 15 else 8)
    surfaces = [deviating(joint_surface(run_folder, group[0]), group[0]) for _, group in groups]
    pitch = 1.3 * max(np.ptp(surface.points[:, 0]) for surface in surfaces)
    text = LINE * pitch * columns / WIDTH
    step = 1.12 * max(surface.points[:, 2].max() for surface in surfaces) + LINES * text
    rows = -(-len(groups) // columns)
    height = round(WIDTH * rows * step / (columns * pitch)) + BAR
    plotter = new_plotter((WIDTH, height))
    limit = max(float(np.abs(free_of(surface)[DEVIATION]).max()) for surface in surfaces)
    for index, ((names, group), surface) in enumerate(zip(groups, surfaces, strict=True)):
        row, column = divmod(index, columns)
        place = np.array([column * pitch, 0.0, -row * step])
        _add_joint(plotter, surface, place, limit)
        rim = TILT * group[0]["wetted_radius_board"] / MILLI  # that is seen below the disc's centre
        _add_text(plotter, caption(names, group[0], surface), place - np.array([0.0, 0.0, rim + 0.4 * text]))
    _add_bar(plotter)
    _look(plotter, (pitch, step), (rows, columns))
    save(plotter, picture)


def joint_surface(run_folder: Path, joint: Mapping[str, Any]) -> pyvista.DataSet:
    """Read the closed surface of a joint, or where there is none its free surface as the reflow left it [m].

    Cell data ``boundary`` is zero on the free surface.
    """
    for name in (joint["name"], joint["shape"]):
        path = run_folder / f"surface/{name}.vtu"
        if path.exists():
            return pyvista.read(path)
    from reflowshock.particles.scenes.products import read_shapes

    shape = read_shapes(run_folder / "reflow/shapes.h5")[joint["shape"]]
    surface = pyvista.PolyData.from_regular_faces(shape.surface_points, shape.triangles)
    surface.cell_data["boundary"] = np.full(surface.n_cells, FREE)
    return surface


def deviating(surface: pyvista.DataSet, joint: Mapping[str, Any]) -> pyvista.DataSet:
    """Give a surface [m] its signed distance from the truncated sphere of the joint's volume and discs; now in mm."""
    discs = joint["wetted_radius_board"], joint["wetted_radius_package"]
    sphere = TruncatedSphere.of_volume(joint["volume"], *discs)
    surface[DEVIATION] = 1e6 * sphere.signed_distance(np.asarray(surface.points, dtype=float))
    surface.points = np.asarray(surface.points, dtype=float) / MILLI
    return surface


def free_of(surface: pyvista.DataSet) -> pyvista.DataSet:
    """Return the free part of a surface."""
    return surface.extract_cells(surface.cell_data["boundary"] == FREE)


def caption(names: Sequence[str], joint: Mapping[str, Any], surface: pyvista.DataSet) -> str:
    """Name the joints of a shape, and say how high, wide, tilted and how far from the truncated sphere they are."""
    more = f" +{len(names) - MAXIMUM_NAMES}" if len(names) > MAXIMUM_NAMES else ""
    deviation = free_of(surface)[DEVIATION]
    lines = [
        " ".join(names[:MAXIMUM_NAMES]) + more,
        f"{1e6 * joint['standoff']:.1f} x {1e6 * joint['max_width']:.1f} µm",
        f"{joint['angles']} deg" if "angles" in joint else "",
        f"{deviation.min():+.1f} to {deviation.max():+.1f} µm",
        f"tilt {1e3 * joint['tilted']:.1f} mrad" if "tilted" in joint else "",
    ]
    return "\n".join(line for line in lines if line)


def _add_joint(plotter: pyvista.Plotter, surface: pyvista.DataSet, place: np.ndarray, limit: float) -> None:
    surface = surface.translate(place, inplace=False)
    discs = surface.extract_cells(surface.cell_data["boundary"] != FREE)
    if discs.n_cells:
        plotter.add_mesh(discs, color="#b87333")
    colours = {
        "scalars": DEVIATION,
        "cmap": "coolwarm",
        "clim": (-limit, limit),
        "show_scalar_bar": False,
        "ambient": 0.3,
        "diffuse": 0.72,
    }
    plotter.add_mesh(free_of(surface), **colours)


def _add_text(plotter: pyvista.Plotter, text: str, place: np.ndarray) -> None:
    plotter.add_point_labels(
        [place],
        [text],
        shape=None,
        font_size=24,
        text_color="black",
        show_points=False,
        always_visible=True,
        justification_horizontal="center",
        justification_vertical="top",
    )


def _add_bar(plotter: pyvista.Plotter) -> None:
    plotter.add_scalar_bar(
        title="deviation from the truncated sphere of the same volume [µm]",
        n_labels=5,
        fmt="%+.0f",
        vertical=False,
        position_x=0.3,
        position_y=0.01,
        width=0.4,
        height=80 / plotter.window_size[1],
        title_font_size=22,
        label_font_size=20,
        color="black",
    )


def _look(plotter: pyvista.Plotter, cell: tuple[float, float], counts: tuple[int, int]) -> None:
    """Look at all cells of the gallery from the front, from slightly above, in parallel projection."""
    (pitch, step), (rows, columns) = cell, counts
    pixel = columns * pitch / WIDTH
    middle = (0.5 * plotter.window_size[1] - BAR) * pixel  # of the picture, over the lowest row's texts
    bottom = -(rows - 1) * step - LINES * LINE * pixel
    centre = np.array([0.5 * (columns - 1) * pitch, 0.0, bottom + middle])
    plotter.camera_position = [tuple(centre + np.array([0.0, -100.0, 100.0 * TILT])), tuple(centre), (0.0, 0.0, 1.0)]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 0.5 * pixel * plotter.window_size[1]


def array_map(joints: Sequence[Mapping[str, Any]]) -> str:
    """Draw standoff, width, contact angle and tilt or second contact angle of every joint at its place in the array.

    Args:
        joints: records with name, x, y, standoff, max_width [m] and verdict, and what else of ``MAPS`` the joints have.

    Returns:
        An SVG element; joints whose verdict is not ok have a red rim.
    """
    shown = [entry for entry in MAPS if any(entry[0] in joint for joint in joints)][:PANELS]
    rows = -(-len(shown) // 2)
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(rows, 2, figsize=(9.2, 3.9 * rows), constrained_layout=True, squeeze=False)
        for axis, entry in zip(axes.flat, shown, strict=False):
            _draw_map(axis, joints, entry)
        for axis in axes.flat[len(shown) :]:
            axis.set_visible(False)
        return svg(figure)


def pitch_of(joints: Sequence[Mapping[str, Any]]) -> float:
    """Return the smallest distance of two joints along x or y [m]; 1 mm for a single one."""
    steps = [np.diff(np.unique(np.round([joint[axis] for joint in joints], 9))) for axis in ("x", "y")]
    return float(min(np.concatenate(steps), default=MILLI))


def _draw_map(axis: Axes, joints: Sequence[Mapping[str, Any]], entry: tuple[str, str, float]) -> None:
    key, label, unit = entry
    values = np.array([joint.get(key, 0.0) for joint in joints]) / unit
    x, y = (np.array([joint[name] for joint in joints]) / MILLI for name in "xy")
    count = 1 + max(np.ptp(x), np.ptp(y)) * MILLI / pitch_of(joints)
    width = MAP_POINTS / (count + 0.3)  # points between two joints
    rims = ["white" if joint.get("verdict", "ok") in ("ok", "given") else NOT_OK for joint in joints]
    marks = axis.scatter(x, y, c=values, s=(MARK_SHARE * width) ** 2, cmap="viridis", edgecolors=rims, linewidths=1.2)
    size = min(8.5, 0.19 * width)
    if size >= SMALLEST_TEXT:
        _write_names(axis, joints, (x, y, values), size)
    margin = 0.65 * pitch_of(joints) / MILLI
    axis.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", axisbelow=True)
    axis.set(xlim=(x.min() - margin, x.max() + margin), ylim=(y.min() - margin, y.max() + margin))
    axis.figure.colorbar(marks, ax=axis, label=label)


def _write_names(axis: Axes, joints: Sequence[Mapping[str, Any]], places: tuple, size: float) -> None:
    values = places[2]
    span = float(np.ptp(values)) or 1.0
    digits = 0 if np.abs(values).max() >= 100.0 else 1 if np.abs(values).max() >= 10.0 else 2
    for joint, x, y, value in zip(joints, *places, strict=True):
        light = np.dot(colormaps["viridis"]((value - values.min()) / span)[:3], (0.3, 0.6, 0.1)) > 0.5
        text = f"{joint['name']}\n{value:.{digits}f}"
        axis.annotate(text, (x, y), ha="center", va="center", fontsize=size, color="black" if light else "white")
