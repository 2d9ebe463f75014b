"""Rendered pictures of the report: stressed joints, the bent board, and what all pictures share."""

import base64
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import pyvista
from matplotlib import pyplot

from reflowshock.fem.output.ranking import VON_MISES, critical_joint

if TYPE_CHECKING:
    from reflowshock.particles.steps.shape import JointShape, Snapshot

Told = TypeVar("Told")

MILLI = 1.0e-3
MEGA = 1.0e6
WINDOW = (1600, 800)
SMALLEST_RANGE = 0.01  # of colours, about the mean
ROW_SHARE = 0.86  # of the width, which a row of bodies fills
SCALAR_BAR = {"vertical": True, "position_x": 0.88, "position_y": 0.3, "height": 0.5, "color": "black", "n_labels": 4}


def render_joints(series: list[Path], history: dict, parts: list[str], picture: Path) -> str:
    """Render all joints under their package, coloured by von Mises stress, when the critical one is stressed most.

    Args:
        series: PVD files of the models that have them, all of one run.
        history: arrays of ``history.npz``.
        parts: names of the parts, in the order of the field ``part``.
        picture: PNG file to write.

    Returns:
        A caption.
    """
    column = critical_joint(history)
    critical, stress = str(history["joints"][column]), VON_MISES.worse(history)[:, column]
    grid, time = _fields_near(series, float(history["time"][np.argmax(stress)]))
    draw_joints(grid, parts, critical, float(stress.max()), picture)
    return (
        f"Von Mises stress in the joints at {1e3 * time:.3f} ms, seen from the package's corner; the package is drawn "
        f"as an outline. The scale ends at the average over {critical}'s layer at its worse pad; single elements reach"
        " more, the more so the finer they are."
    )


def draw_joints(grid: pyvista.UnstructuredGrid, parts: list[str], marked: str, top: float, picture: Path) -> None:
    """Draw all joints of a grid under the outline of their package, coloured by von Mises stress.

    Args:
        grid: whole model [m], with its parts and stresses [Pa].
        parts: names of the parts, in the order of the field ``part``.
        marked: joint whose name is written.
        top: where the colours end [Pa].
        picture: PNG file to write.
    """
    grid.points = grid.points / MILLI
    grid["von Mises [MPa]"] = grid.cell_data["von_mises"] / MEGA
    parts = ["" if is_neighbour(name) else name for name in parts]
    plotter = new_plotter((1800, 1000))
    plotter.add_mesh(
        _of_role(grid, parts, "solder"),
        scalars="von Mises [MPa]",
        cmap="turbo",
        clim=(0.0, top / MEGA),
        scalar_bar_args=SCALAR_BAR | {"fmt": "%.3g"},
        show_edges=True,
        edge_color="#3a4048",
        line_width=0.3,
    )
    _add_part(plotter, _of_role(grid, parts, "copper"), color="#b87333")
    board = {"color": "#9cc9a7", "show_edges": True, "edge_color": "#5d8f6b", "line_width": 0.5}
    _add_part(plotter, _of_role(grid, parts, "board_patch"), **board)
    _add_part(plotter, _of_role(grid, parts, "board_column"), **board)
    for role, colour in (("substrate", "#c9a227"), ("die", "#5b6770")):
        outline = _of_role(grid, parts, role).extract_surface(algorithm="dataset_surface").extract_feature_edges(60)
        _add_part(plotter, outline, color=colour, line_width=3)
    _add_name(plotter, _of_role(grid, parts, f"solder@{marked}"), marked)
    plotter.camera_position = [(1.5, 1.15, 0.75), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera()
    plotter.camera.zoom(1.4)
    save(plotter, picture)


def render_board(series: list[Path], history: dict, parts: list[str], picture: Path) -> str:
    """Render the board at its largest deflection, exaggerated, coloured by displacement; arguments as above."""
    deflection = np.abs(history["board_centre"][:, 2])
    grid, time = _fields_near(series, float(history["time"][np.argmax(deflection)]))
    grid = _of_role(grid, parts, "board")
    grid["deflection [mm]"] = grid.point_data["displacement"][:, 2] / MILLI
    length = max(grid.bounds[1] - grid.bounds[0], grid.bounds[3] - grid.bounds[2])
    factor = exaggeration(length, float(np.abs(grid.point_data["displacement"][:, 2]).max()))
    bent = grid.warp_by_vector("displacement", factor=factor)
    bent.points = bent.points / MILLI
    plotter = new_plotter((1800, 900))
    plotter.add_mesh(
        bent,
        scalars="deflection [mm]",
        cmap="coolwarm",
        show_edges=True,
        edge_color="#55606b",
        line_width=0.4,
        scalar_bar_args=SCALAR_BAR | {"fmt": "%.3g"},
    )
    flat = grid.copy()
    flat.points = flat.points / MILLI
    plotter.add_mesh(
        flat.extract_surface(algorithm="dataset_surface").extract_feature_edges(60), color="#8a949e", line_width=1.5
    )
    plotter.camera_position = [(-0.8, -1.8, 0.7), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera()
    plotter.camera.zoom(1.5)
    save(plotter, picture)
    return f"The board at {1e3 * time:.3f} ms, deflection drawn {factor:g} times as large; grey: at rest."


def is_neighbour(part: str) -> bool:
    """Whether a part belongs to a package whose joints are not meshed: `<role>_<name>`, of no joint."""
    return part.startswith(("solder_", "substrate_", "die_")) and "@" not in part


def _of_role(grid: pyvista.UnstructuredGrid, parts: list[str], role: str) -> pyvista.UnstructuredGrid:
    """Cells of the parts whose names start with ``role``."""
    chosen = [number for number, name in enumerate(parts) if name.startswith(role)]
    return grid.extract_cells(np.isin(grid.cell_data["part"].astype(int), chosen))


def _add_name(plotter: pyvista.Plotter, solder: pyvista.DataSet, name: str) -> None:
    """Write the name of a joint above it."""
    plotter.add_point_labels(
        [(solder.center[0], solder.center[1], solder.bounds[5] + 0.05)],
        [name],
        font_size=26,
        text_color="#b3261e",
        justification_horizontal="center",
        shape=None,
        show_points=False,
        always_visible=True,
    )


def _add_part(plotter: pyvista.Plotter, part: pyvista.DataSet, **style) -> None:
    """Add a part, unless the models that are drawn have nothing of it."""
    if part.n_cells:
        plotter.add_mesh(part, **style)


def _fields_near(series: list[Path], time: float) -> tuple[pyvista.UnstructuredGrid, float]:
    """Read series of the models of a run at their stored time nearest to ``time`` [s], as one grid."""
    grids, stored = pyvista.MultiBlock(), time
    for path in series:
        reader = pyvista.get_reader(path)
        stored = min(reader.time_values, key=lambda value: abs(value - time))
        reader.set_active_time_value(stored)
        grids.append(_linear(reader.read().combine(merge_points=True)))
    return grids.combine(merge_points=True), stored


def _linear(grid: pyvista.UnstructuredGrid) -> pyvista.UnstructuredGrid:
    """The same cells as plain hexahedra: first-order Lagrange cells are drawn with the edges of their tessellation."""
    cells = grid.cell_connectivity.reshape(-1, 8)
    plain = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: cells}, grid.points)
    plain.point_data.update({"displacement": grid.point_data["displacement"]})
    plain.cell_data.update({name: grid.cell_data[name] for name in ("von_mises", "part")})
    return plain


def exaggeration(length: float, deflection: float) -> float:
    """Return how many times as large a deflection is drawn; once where a board is still at rest."""
    return round_down(0.12 * length / deflection) if deflection > 0.0 else 1.0


def round_down(factor: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(factor))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= factor))


def new_plotter(size=WINDOW) -> pyvista.Plotter:
    """Return an off-screen view with a white background."""
    plotter = pyvista.Plotter(off_screen=True, window_size=list(size))
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def save(plotter: pyvista.Plotter, picture: Path) -> None:
    """Write the view without the white around it."""
    image = plotter.screenshot(return_img=True)
    plotter.close()
    drawn = np.any(image < 250, axis=2)
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    margin = 12
    box = image[max(rows[0] - margin, 0) : rows[-1] + margin, max(columns[0] - margin, 0) : columns[-1] + margin]
    pyplot.imsave(picture, box)


def embedded(draw: Callable[[Path], Told]) -> tuple[str, Told]:
    """Let a function write a PNG file; return it in base64, and what the function returned."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.png"
        result = draw(picture)
        return base64.b64encode(picture.read_bytes()).decode(), result


def render_stages(stages: "Sequence[Snapshot]", shape: "JointShape", picture: Path) -> None:
    """Render particles and free surface at some times side by side, then at the end, coloured by pressure."""
    plotter = new_plotter((1800, 800))
    states = [*((stage.points, stage.triangles) for stage in stages), (shape.points, shape.triangles)]
    place, size = 0.0, {"point_size": 11, "render_points_as_spheres": True}
    for index, (points, triangles) in enumerate(states):
        points = points / MILLI
        points = points + np.array([place - points[:, 0].min(), 0.0, 0.0])
        place = points[:, 0].max() + 0.2 * np.ptp(points[:, 0])
        faces = np.column_stack((np.full(len(triangles), 3), triangles))
        surface = pyvista.PolyData(points, faces.ravel())
        plotter.add_mesh(surface, color="#b9c4cf", opacity=0.35, show_edges=True, edge_color="#5f6c7b", line_width=0.6)
        if index < len(stages):
            plotter.add_mesh(pyvista.PolyData(points), color="#8a949e", **size)
        else:
            _add_coloured(plotter, points, shape.pressure, size)
    _look_at_row(plotter)
    save(plotter, picture)


def _look_at_row(plotter: pyvista.Plotter) -> None:
    """Look at a row along x from slightly above, so that it fills the picture but for the bar on the right."""
    left, right, front, back, low, high = plotter.bounds
    aspect = plotter.window_size[0] / plotter.window_size[1]
    width = max((right - left) / ROW_SHARE, 1.05 * aspect * (high - low + 0.4 * (back - front)))
    centre = np.array([left + 0.5 * width - 0.02 * width, 0.0, 0.5 * (low + high)])
    plotter.camera_position = [centre + width * np.array([0.0, -10.0, 4.0]), centre, (0.0, 0.0, 1.0)]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 0.5 * width / aspect
    plotter.camera.clipping_range = (width, 20.0 * width)


def _add_coloured(plotter: pyvista.Plotter, points: np.ndarray, pressure: np.ndarray, size: dict) -> None:
    """Add particles at points `(n, 3)` [mm] coloured by their pressure `(n,)` [Pa], and the bar of the colours."""
    cloud = pyvista.PolyData(points)
    cloud["pressure [Pa]"] = pressure
    bar = {"vertical": True, "position_x": 0.92, "position_y": 0.25, "height": 0.5, "color": "black", "n_labels": 3}
    bar, limits = bar | {"fmt": "%.4g"}, _colour_limits(pressure)
    plotter.add_mesh(cloud, scalars="pressure [Pa]", cmap="viridis", clim=limits, scalar_bar_args=bar, **size)


def _colour_limits(pressure: np.ndarray) -> tuple[float, float]:
    """Range of the colours: that of the values, at least one per cent about the mean, so that equal ones look equal."""
    mean = float(pressure.mean())
    low, high = float(pressure.min()), float(pressure.max())
    return min(low, mean - SMALLEST_RANGE * abs(mean)), max(high, mean + SMALLEST_RANGE * abs(mean))
