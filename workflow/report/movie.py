"""A scene as a GIF: its frames one after the other, as the page shows them at first; to send where no page can go."""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.workflow.report.colours import SCALES
from reflowshock.workflow.report.scene import Field, Group, Scene, decimated

SIZE = (720, 480)  # pixels
FRAME, LAST = 350, 1500  # ms that a frame is shown, and the last one
COLOURS = 128  # of a frame
GHOST = 0.15  # opacity of what one sees through
UP = (0.0, 0.0, 1.0)
ROOM = 0.35  # around what is looked at, as a share of its size


def write_movie(scene: Scene, path: Path) -> None:
    """Write the frames of a scene; displacements as many times as large as the page shows them at first.

    Args:
        scene: with two frames or more.
        path: of the GIF, written under a temporary name, then renamed.
    """
    import pyvista
    from PIL import Image

    groups = [group for group in decimated(scene.groups) if len(group.points)]
    plotter = pyvista.Plotter(off_screen=True, window_size=list(SIZE))
    plotter.set_background("white")
    pictures = []
    for frame, label in enumerate(scene.frames):
        plotter.clear()
        shown = [group for group in groups if group.only in (None, frame)]
        for group in shown:
            _add(plotter, group, scene, frame, _carried(groups, frame))
        times = f", displacement x {scene.exaggeration:g}" if scene.exaggeration > 1.0 else ""
        plotter.add_text(f"{label}{times}", font_size=10, color="black")
        if frame == 0:
            _look(plotter, shown, scene.view)
        pictures.append(Image.fromarray(plotter.screenshot(return_img=True)).quantize(COLOURS))
    plotter.close()
    partial = path.with_name(f".{path.name}.partial")
    durations = [FRAME] * (len(pictures) - 1) + [LAST]
    pictures[0].save(partial, "GIF", save_all=True, append_images=pictures[1:], duration=durations, loop=0)
    partial.rename(path)


def _looked_at(groups: Sequence[Group]) -> list[Group]:
    """Return the groups that one does not see through; all where there are no others."""
    return [group for group in groups if not group.is_ghost] or list(groups)


def _carried(groups: Sequence[Group], frame: int) -> Any:
    """Return the displacement [m] that is not drawn: where a part is looked at among others, the mean of its own."""
    first = _looked_at(groups)[0]
    if first.displacement is None or not any(group.is_ghost for group in groups):
        return 0.0
    return _in_frame(first.displacement, frame).mean(axis=0)


def _add(plotter: Any, group: Group, scene: Scene, frame: int, carried: Any) -> None:
    """Add the surface of a group where it is in a frame, in the colours of the first field that it has."""
    import pyvista

    own = 0.0 if group.displacement is None else _in_frame(group.displacement, frame) - carried
    moved = scene.exaggeration * own
    points, faces = group.points + moved, np.asarray(group.faces)
    surface = pyvista.PolyData.from_regular_faces(points, faces) if len(faces) else pyvista.PolyData(points)
    style: dict[str, Any] = {"color": group.colour, "opacity": GHOST if group.is_ghost else 1.0}
    shown = next((one for one in scene.fields if one.name in group.values), None)
    if shown is not None:
        surface.point_data[shown.name] = _in_frame(group.values[shown.name], frame)
        style = _coloured(shown)
    plotter.add_mesh(surface, render_points_as_spheres=True, point_size=6, **style)


def _coloured(shown: Field) -> dict[str, Any]:
    """Return how a field is coloured."""
    from matplotlib.colors import LinearSegmentedColormap

    title = textwrap.fill(f"{shown.name} [{shown.unit}]", 14)
    return {
        "scalars": shown.name,
        "clim": (shown.low, shown.high),
        "cmap": LinearSegmentedColormap.from_list(shown.scale, SCALES[shown.scale]),
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


def _look(plotter: Any, shown: Sequence[Group], view: tuple[float, float, float]) -> None:
    """Point the camera at the groups that one does not see through, with some room around them."""
    points = np.concatenate([group.points for group in _looked_at(shown)])
    low, high = points.min(axis=0), points.max(axis=0)
    room = ROOM * float(np.max(high - low))
    plotter.camera_position = [view, (0.0, 0.0, 0.0), UP]
    plotter.reset_camera(bounds=np.column_stack([low - room, high + room]).ravel())
