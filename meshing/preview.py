"""A picture of the meshed board and package, in seconds."""

from pathlib import Path

import meshio
import numpy as np
import pyvista

MILLI = 1.0e-3
COLOURS = {
    "board": "#3d7d4d",
    "board_patch": "#6fb07f",
    "substrate": "#c9a227",
    "die": "#5b6770",
    "copper": "#b87333",
    "solder": "#c9ced6",
}


def write_preview(paths: list[Path], picture: Path) -> None:
    """Render the hexahedra of Gmsh files, coloured by part: the whole on the left, the package on the right.

    Args:
        paths: ``.msh`` files (assembly, and joints if they exist).
        picture: PNG file to write.
    """
    parts = [part for path in paths for part in _parts(path)]
    plotter = pyvista.Plotter(off_screen=True, shape=(1, 2), window_size=[1800, 760], border=False)
    for column in (0, 1):
        plotter.subplot(0, column)
        plotter.set_background("white")
        for name, grid in parts:
            plotter.add_mesh(
                grid.extract_surface(algorithm="dataset_surface"), color=colour(name), show_edges=True,
                edge_color="#26323c", line_width=1, ambient=0.25,
            )  # fmt: skip
    plotter.subplot(0, 0)
    plotter.add_text("whole model", font_size=11, color="black")
    _look_at(plotter, _bounds([grid for _, grid in parts]), 1.35)
    plotter.subplot(0, 1)
    plotter.add_text("package", font_size=11, color="black")
    plotter.add_legend(
        [(role, colour(role)) for role in COLOURS if any(_role(name) == role for name, _ in parts)],
        bcolor="white", face="rectangle", size=(0.2, 0.22), loc="upper right",
    )  # fmt: skip
    _look_at(plotter, _bounds([grid for name, grid in parts if _role(name) != "board"]), 1.25)
    plotter.screenshot(picture)
    plotter.close()


def colour(part: str) -> str:
    """Colour of a part by its role."""
    return COLOURS[_role(part)]


def _role(part: str) -> str:
    role = part.split("@")[0]
    return role if role in COLOURS else role.split("_")[0]


def _parts(path: Path) -> list[tuple[str, pyvista.UnstructuredGrid]]:
    mesh = meshio.read(path)
    names = {tag: name for name, (tag, dimension) in mesh.field_data.items() if dimension == 3}
    hexahedra = [
        (block.data, tags)
        for block, tags in zip(mesh.cells, mesh.cell_data["gmsh:physical"], strict=True)
        if block.type == "hexahedron"
    ]
    cells = np.vstack([data for data, _ in hexahedra])
    tags = np.concatenate([tags for _, tags in hexahedra])
    points = mesh.points / MILLI
    return [
        (name, pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: cells[tags == tag]}, points).clean())
        for tag, name in names.items()
    ]


def _bounds(grids: list[pyvista.UnstructuredGrid]) -> np.ndarray:
    boxes = np.array([grid.bounds for grid in grids]).reshape(-1, 3, 2)
    return np.column_stack([boxes[:, :, 0].min(axis=0), boxes[:, :, 1].max(axis=0)])


def _look_at(plotter: pyvista.Plotter, bounds: np.ndarray, zoom: float) -> None:
    """View from the inner corner (towards which a quarter model is cut open), from above."""
    centre, size = bounds.mean(axis=1), np.linalg.norm(bounds[:, 1] - bounds[:, 0])
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + size * np.array([-1.0, -1.4, 1.0])
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.reset_camera(bounds=bounds.ravel())
    plotter.camera.zoom(zoom)
