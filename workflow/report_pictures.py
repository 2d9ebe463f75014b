"""Rendered pictures of the report: joint shapes, stressed joints, the bent board."""

from pathlib import Path

import numpy as np
import pyvista

MILLI = 1.0e-3
MEGA = 1.0e6
WINDOW = (1600, 800)


def render_shapes(surface_folder: Path, joints: list[dict], picture: Path) -> None:
    """Render every distinct joint shape in a row, by increasing standoff.

    Args:
        surface_folder: folder of the closed surfaces, one VTU file a shape.
        joints: records with shape, name, standoff [m].
        picture: PNG file to write.
    """
    firsts = {joint["shape"]: joint for joint in reversed(joints)}
    ordered = sorted(firsts.values(), key=lambda joint: joint["standoff"])
    columns = min(len(ordered), 8)
    plotter = _plotter((1600, 260 * -(-len(ordered) // columns)))
    spacing = 1.35 * max(joint["max_width"] for joint in ordered) / MILLI
    for index, joint in enumerate(ordered):
        surface = pyvista.read(surface_folder / f"{joint['shape']}.vtu")
        surface.points = surface.points / MILLI
        surface["radius"] = 1.0e3 * np.hypot(surface.points[:, 0], surface.points[:, 1])
        row, column = divmod(index, columns)
        surface.translate((column * spacing, 0.0, -0.9 * row * spacing), inplace=True)
        plotter.add_mesh(
            surface, scalars="radius", cmap="viridis", smooth_shading=True, split_sharp_edges=True,
            scalar_bar_args={"title": "radius [um]", "n_labels": 3, "vertical": False, "position_x": 0.4, "position_y": 0.01, "height": 0.06},
        )  # fmt: skip
        top = surface.points[:, 2].max()
        label = f"{joint['name']}: {1e6 * joint['standoff']:.0f} um"
        plotter.add_point_labels(
            [(column * spacing, 0.0, top + 0.1)], [label], shape=None, font_size=16, text_color="black",
            show_points=False, always_visible=True, justification_horizontal="center",
        )  # fmt: skip
    plotter.view_xz()
    plotter.enable_parallel_projection()
    plotter.camera.elevation = 12
    plotter.camera.zoom(1.25)
    _save(plotter, picture)


def render_joints(folder: Path, history: dict, solder_parts: list[int], picture: Path) -> str:
    """Render the solder of all joints in place, coloured by von Mises stress, when the worst joint is stressed most.

    Args:
        folder: folder of the shock run with its PVD files.
        history: arrays of ``history.npz``.
        solder_parts: numbers of the parts that are solder, in the field ``part``.
        picture: PNG file to write.

    Returns:
        A caption.
    """
    stress = np.maximum(history["von_mises_board"], history["von_mises_package"]).max(axis=1)
    grid, time = _fields_near(folder, ("meso", "dns"), float(history["time"][np.argmax(stress)]))
    solder = grid.extract_cells(np.isin(grid.cell_data["part"].astype(int), solder_parts))
    solder.points = solder.points / MILLI
    solder["von Mises [MPa]"] = solder.cell_data["von_mises"] / MEGA
    plotter = _plotter((1600, 820))
    plotter.add_mesh(
        solder, scalars="von Mises [MPa]", cmap="inferno", show_edges=True, edge_color="#404a55", line_width=0.6,
        scalar_bar_args={"vertical": True, "position_x": 0.9, "position_y": 0.2, "height": 0.6, "color": "black", "n_labels": 4},
    )  # fmt: skip
    plotter.camera_position = [(-0.9, -1.6, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera()
    plotter.camera.zoom(1.35)
    _save(plotter, picture)
    return f"Von Mises stress in the solder of every joint at {1e3 * time:.3f} ms, seen from the package's axis outwards."


def render_board(folder: Path, history: dict, picture: Path) -> str:
    """Render the board at its largest deflection, exaggerated, coloured by displacement; return a caption."""
    deflection = np.abs(history["board_centre"][:, 2])
    grid, time = _fields_near(folder, ("macro", "dns"), float(history["time"][np.argmax(deflection)]))
    largest = float(np.abs(grid.point_data["displacement"][:, 2]).max())
    length = max(grid.bounds[1] - grid.bounds[0], grid.bounds[3] - grid.bounds[2])
    factor = _round_down(0.12 * length / largest)
    bent = grid.warp_by_vector("displacement", factor=factor)
    bent["deflection [mm]"] = grid.point_data["displacement"][:, 2] / MILLI
    bent.points = bent.points / MILLI
    plotter = _plotter((1600, 760))
    plotter.add_mesh(
        bent, scalars="deflection [mm]", cmap="coolwarm", show_edges=True, edge_color="#55606b", line_width=0.4,
        scalar_bar_args={"vertical": True, "position_x": 0.9, "position_y": 0.2, "height": 0.6, "color": "black", "n_labels": 4},
    )  # fmt: skip
    plotter.camera_position = [(-0.8, -1.8, 0.8), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera()
    plotter.camera.zoom(1.4)
    _save(plotter, picture)
    return f"The board at {1e3 * time:.3f} ms, its deflection drawn {factor:g} times as large."


def _fields_near(folder: Path, names: tuple[str, ...], time: float) -> tuple[pyvista.UnstructuredGrid, float]:
    """Read the first of the named series that exists at its stored time nearest to ``time`` [s]."""
    path = next(folder / f"{name}.pvd" for name in names if (folder / f"{name}.pvd").exists())
    reader = pyvista.get_reader(path)
    stored = min(reader.time_values, key=lambda value: abs(value - time))
    reader.set_active_time_value(stored)
    return reader.read().combine(), stored


def _round_down(factor: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(factor))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= factor))


def _plotter(size=WINDOW) -> pyvista.Plotter:
    plotter = pyvista.Plotter(off_screen=True, window_size=list(size))
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def _save(plotter: pyvista.Plotter, picture: Path) -> None:
    plotter.screenshot(picture)
    plotter.close()
