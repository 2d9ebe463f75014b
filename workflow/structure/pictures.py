"""Rendered pictures of a structure: its largest deformation, its modes."""

from pathlib import Path

import numpy as np
import pyvista

from reflowshock.workflow.report.pictures import MILLI, SCALAR_BAR, new_plotter, round_down, save

CELL_TYPES = {
    8: pyvista.CellType.HEXAHEDRON,
    4: pyvista.CellType.TETRA,
    10: pyvista.CellType.QUADRATIC_TETRA,
}
EYE = (-0.8, -1.8, 0.9)
SHARE = 0.12  # of the structure's size, that its deformation is drawn as
COLUMNS = 3


def render_deformation(series: list[Path], time: float, picture: Path) -> str:
    """Render the models of a structure at the stored time nearest to a time [s], exaggerated; return a caption."""
    readers = [pyvista.get_reader(path) for path in series]
    grid = pyvista.merge([_read(reader, time) for reader in readers])
    stored = _nearest(readers[0], time)
    size = np.linalg.norm(grid.point_data["displacement"], axis=1)
    extent = float(np.ptp(grid.points, axis=0).max())
    factor = max(round_down(SHARE * extent / float(size.max())), 1.0) if size.max() > 0.0 else 1.0
    unit, scale = ("mm", MILLI) if size.max() > 1e-2 * MILLI else ("µm", 1e-6)
    title = f"displacement [{unit}]"
    grid[title] = size / scale
    plotter = new_plotter((1800, 900))
    _add_bent(plotter, grid, factor, title, SCALAR_BAR | {"fmt": "%.3g"})
    _look(plotter)
    save(plotter, picture)
    return f"The structure at {1e3 * stored:.4g} ms, displacement drawn {factor:g} times as large; grey: at rest."


def render_modes(series: Path, modes: list[dict], picture: Path) -> None:
    """Render the shapes of natural modes, each with its frequency."""
    columns = min(COLUMNS, len(modes))
    rows = -(-len(modes) // columns)
    plotter = pyvista.Plotter(
        off_screen=True, shape=(rows, columns), window_size=[600 * columns, 420 * rows], border=False
    )
    plotter.set_background("white", all_renderers=True)
    reader = pyvista.get_reader(series)
    for index, mode in enumerate(modes):
        plotter.subplot(*divmod(index, columns))
        grid = _read(reader, float(mode["mode"]))
        grid["size"] = np.linalg.norm(grid.point_data["displacement"], axis=1)
        _add_bent(plotter, grid, 1.0, "size", None)
        plotter.add_text(f"{mode['mode']}: {mode['frequency']:.1f} Hz", font_size=12, color="black")
        _look(plotter)
    plotter.screenshot(picture)
    plotter.close()


def _nearest(reader: pyvista.PVDReader, time: float) -> float:
    """Return the stored time nearest to a time [s]: those of two models differ by rounding."""
    return min(reader.time_values, key=lambda value: abs(value - time))


def _read(reader: pyvista.PVDReader, time: float) -> pyvista.UnstructuredGrid:
    """Read the state nearest to a time [s] with plain cells: those of Lagrange type would show their tessellation."""
    reader.set_active_time_value(_nearest(reader, time))
    grid = reader.read().combine(merge_points=True)
    nodes = len(grid.cell_connectivity) // grid.n_cells
    plain = pyvista.UnstructuredGrid({CELL_TYPES[nodes]: grid.cell_connectivity.reshape(-1, nodes)}, grid.points)
    plain.point_data.update({"displacement": grid.point_data["displacement"]})
    return plain


def _add_bent(
    plotter: pyvista.Plotter, grid: pyvista.UnstructuredGrid, factor: float, colour: str, bar: dict | None
) -> None:
    """Add the deformed structure and the outline of the one at rest."""
    bent = grid.warp_by_vector("displacement", factor=factor)
    bent.points = bent.points / MILLI
    surface = bent.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=0)
    plotter.add_mesh(
        surface, scalars=colour, cmap="viridis", show_edges=True, edge_color="#55606b", line_width=0.4,
        show_scalar_bar=bar is not None, scalar_bar_args=bar,
    )  # fmt: skip
    flat = grid.copy()
    flat.points = flat.points / MILLI
    outline = flat.extract_surface(algorithm="dataset_surface").extract_feature_edges(60)
    plotter.add_mesh(outline, color="#8a949e", line_width=1.5)


def _look(plotter: pyvista.Plotter) -> None:
    plotter.camera_position = [EYE, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera()
    plotter.camera.zoom(1.35)
