"""Animated GIF of the frames of a 3D scene, in the initial view of the page."""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.workflow.report.colours import SCALES
from reflowshock.workflow.report.scene import Field, Group, Scene, decimate

SIZE = (720, 480)  # pixels
FRAME, LAST = 350, 1500  # [ms] duration of a frame and of the last frame
COLOURS = 128  # colours of a frame
GHOST = 0.15  # opacity of transparent groups
UP = (0.0, 0.0, 1.0)
MARGIN = 0.35  # margin around the focus, as a share of its size


def write_movie(scene: Scene, path: Path) -> None:
    """Write the frames of a scene as an animated GIF, with the initial displacement scale of the page.

    Args:
        scene: Scene with two frames or more.
        path: Path of the GIF, which is written under a temporary name and renamed.
    """
    import pyvista
    from PIL import Image

    groups = [group for group in decimate(scene.groups) if len(group.points)]
    plotter = pyvista.Plotter(off_screen=True, window_size=list(SIZE))
    plotter.set_background("white")
    pictures = []
    for frame, label in enumerate(scene.frames):
        plotter.clear()
        visible = [group for group in groups if group.only in (None, frame)]
        for group in visible:
            _add(plotter, group, scene, frame, _carried(groups, frame))
        times = f", displacement x {scene.exaggeration:g}" if scene.exaggeration > 1.0 else ""
        plotter.add_text(f"{label}{times}", font_size=10, color="black")
        if frame == 0:
            _look(plotter, visible, scene.view)
        pictures.append(Image.fromarray(plotter.screenshot(return_img=True)).quantize(COLOURS))
    plotter.close()
    partial = path.with_name(f".{path.name}.partial")
    durations = [FRAME] * (len(pictures) - 1) + [LAST]
    pictures[0].save(partial, "GIF", save_all=True, append_images=pictures[1:], duration=durations, loop=0)
    partial.rename(path)


def _focus(groups: Sequence[Group]) -> list[Group]:
    """Return the opaque groups; all groups if none is opaque."""
    return [group for group in groups if not group.is_ghost] or list(groups)


def _carried(groups: Sequence[Group], frame: int) -> Any:
    """Return the rigid displacement [m] to subtract: the mean of the focus among transparent groups, else zero."""
    first = _focus(groups)[0]
    if first.displacement is None or not any(group.is_ghost for group in groups):
        return 0.0
    return _in_frame(first.displacement, frame).mean(axis=0)


def _add(plotter: Any, group: Group, scene: Scene, frame: int, carried: Any) -> None:
    """Add the surface of a group in a frame, coloured by its first field."""
    import pyvista

    relative = 0.0 if group.displacement is None else _in_frame(group.displacement, frame) - carried
    moved = scene.exaggeration * relative
    points, faces = group.points + moved, np.asarray(group.faces)
    surface = pyvista.PolyData.from_regular_faces(points, faces) if len(faces) else pyvista.PolyData(points)
    style: dict[str, Any] = {"color": group.colour, "opacity": GHOST if group.is_ghost else 1.0}
    coloured_by = next((item for item in scene.fields if item.name in group.values), None)
    if coloured_by is not None:
        surface.point_data[coloured_by.name] = _in_frame(group.values[coloured_by.name], frame)
        style = _coloured(coloured_by)
    plotter.add_mesh(surface, render_points_as_spheres=True, point_size=6, **style)


def _coloured(field: Field) -> dict[str, Any]:
    """Return the plotting style of a field."""
    from matplotlib.colors import LinearSegmentedColormap

    title = textwrap.fill(f"{field.name} [{field.unit}]", 14)
    return {
        "scalars": field.name,
        "clim": (field.low, field.high),
        "cmap": LinearSegmentedColormap.from_list(field.scale, SCALES[field.scale]),
        "scalar_bar_args": {
            "title": title,
            "color": "black",
            "vertical": True,
            "title_font_size": 12,
            "label_font_size": 11,
            "fmt": "%.3g",
            "position_x": 0.84,
            "position_y": 0.45,
            "height": 0.4,
            "width": 0.06,
        },
    }


def _in_frame(values: Floats, frame: int) -> Floats:
    return values[frame] if len(values) > 1 else values[0]


def _look(plotter: Any, visible: Sequence[Group], view: tuple[float, float, float]) -> None:
    """Point the camera at the opaque groups, with a margin around them."""
    points = np.concatenate([group.points for group in _focus(visible)])
    low, high = points.min(axis=0), points.max(axis=0)
    room = MARGIN * float(np.max(high - low))
    plotter.camera_position = [view, (0.0, 0.0, 0.0), UP]
    plotter.reset_camera(bounds=np.column_stack([low - room, high + room]).ravel())
