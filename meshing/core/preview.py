"""Pictures of the meshed board and package, rendered off-screen."""

from pathlib import Path

import meshio
import numpy as np
import pyvista

MILLI = 1.0e-3
COLOURS = {
    "board": "#2f7d46",
    "board_patch": "#62a876",
    "substrate": "#c2971c",
    "die": "#56626e",
    "copper": "#b5622d",
    "solder": "#98a2af",
}
SIZE = (1800, 680)  # pixels; two views side by side
FROM_ABOVE, FROM_THE_SIDE = (-1.0, -1.3, 1.1), (-1.0, -1.3, 0.45)  # quarter models are cut open towards -x and -y
MARGIN = 1.06
LAYER_COLOURS = ("#62a876", "#c2971c", "#56626e", "#b5622d", "#98a2af", "#7a5ea8")
CORNERS_ONLY = {
    "hexahedron": (pyvista.CellType.HEXAHEDRON, 8),
    "tetra": (pyvista.CellType.TETRA, 4),
    "tetra10": (pyvista.CellType.TETRA, 4),
}


def write_preview(paths: list[Path], picture: Path) -> None:
    """Render the hexahedra of Gmsh files as one picture, coloured by part.

    The whole model is on the left, all parts except the board outside the patch are on the right.

    Args:
        paths: ``.msh`` files to read (assembly, and joints if they exist).
        picture: The PNG file to write.
    """
    parts = [part for path in paths for part in _parts(path)]
    around_package = [(name, grid) for name, grid in parts if _role(name) != "board"]
    plotter = pyvista.Plotter(off_screen=True, shape=(1, 2), window_size=list(SIZE), border=False)
    plotter.set_background("white", all_renderers=True)
    views = (("whole model", parts, FROM_ABOVE, 0.5), ("package and patch", around_package, FROM_THE_SIDE, 1.5))
    for column, (title, visible_parts, direction, line_width) in enumerate(views):
        plotter.subplot(0, column)
        for name, grid in visible_parts:
            _add_part(plotter, grid, colour(name), line_width)
        plotter.add_text(title, font_size=12, color="black")
        _fit(plotter, np.vstack([_corners(grid) for _, grid in visible_parts]), direction, 0.5 * SIZE[0] / SIZE[1])
    roles = [role for role in COLOURS if any(_role(name) == role for name, _ in parts)]
    _add_legend(plotter, [(role.replace("_", " "), COLOURS[role]) for role in roles])
    plotter.screenshot(picture)
    plotter.close()


def write_layers_preview(path: Path, picture: Path) -> None:
    """Render the elements of a Gmsh file as a PNG file, each physical volume in a different colour.

    Args:
        path: The ``.msh`` file to read.
        picture: The PNG file to write.
    """
    parts = _parts(path)
    colours = [LAYER_COLOURS[k % len(LAYER_COLOURS)] for k in range(len(parts))]
    plotter = pyvista.Plotter(off_screen=True, window_size=list(SIZE), border=False)
    plotter.set_background("white")
    for (_, grid), layer_colour in zip(parts, colours, strict=True):
        _add_part(plotter, grid, layer_colour, 1.0)
    _fit(plotter, np.vstack([_corners(grid) for _, grid in parts]), FROM_ABOVE, SIZE[0] / SIZE[1])
    _add_legend(plotter, [(name, layer_colour) for (name, _), layer_colour in zip(parts, colours, strict=True)])
    plotter.screenshot(picture)
    plotter.close()


def _add_part(plotter: pyvista.Plotter, grid: pyvista.UnstructuredGrid, tint: str, line_width: float) -> None:
    surface = grid.extract_surface(algorithm="dataset_surface")
    plotter.add_mesh(surface, color=tint, show_edges=True, edge_color="#1d262e", line_width=line_width, ambient=0.3)


def _add_legend(plotter: pyvista.Plotter, entries: list[tuple[str, str]]) -> None:
    size = (0.2, 0.045 * len(entries))
    plotter.add_legend(entries, bcolor="white", face="rectangle", size=size, loc="lower right")


def colour(part: str) -> str:
    """Return the colour of a mesh part, e.g. "solder@A1", by its material role, as a colour name or code of PyVista."""
    return COLOURS[_role(part)]


def _role(part: str) -> str:
    role = part.split("@")[0]
    return role if role in COLOURS else role.split("_")[0]


def _parts(path: Path) -> list[tuple[str, pyvista.UnstructuredGrid]]:
    """Return name and elements of every physical volume, reduced to their corner nodes [mm]."""
    mesh = meshio.read(path)
    names = [name for name, (_, dimension) in mesh.field_data.items() if dimension == 3]
    grids = []
    for name in names:
        pairs = zip(mesh.cells, mesh.cell_sets[name], strict=True)
        blocks = [(block.type, block.data[chosen]) for block, chosen in pairs if len(chosen)]
        kind, corners = CORNERS_ONLY[blocks[0][0]]
        used, cells = np.unique(np.vstack([block[:, :corners] for _, block in blocks]), return_inverse=True)
        elements = {kind: cells.reshape(-1, corners)}
        grids.append((name, pyvista.UnstructuredGrid(elements, mesh.points[used] / MILLI)))
    return grids


def _corners(grid: pyvista.UnstructuredGrid) -> np.ndarray:
    """Return the corners of the bounding box of a part, shape (8, 3) [mm]."""
    x, y, z = np.reshape(grid.bounds, (3, 2))
    return np.array([(a, b, c) for a in x for b in y for c in z])


def _fit(plotter: pyvista.Plotter, points: np.ndarray, direction: tuple[float, float, float], aspect: float) -> None:
    """Point the camera at points (n, 3) from a direction, so that they fill a parallel view of this aspect ratio."""
    toward = np.array(direction) / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(toward, right), toward])
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    half_width, half_height, depth = 0.5 * (high - low)
    focus = 0.5 * (low + high) @ axes
    camera = plotter.camera
    camera.enable_parallel_projection()
    camera.focal_point, camera.position, camera.up = focus, focus + 4.0 * (depth + half_width) * toward, (0.0, 0.0, 1.0)
    camera.parallel_scale = MARGIN * max(half_height, half_width / aspect)
    plotter.renderer.reset_camera_clipping_range()
