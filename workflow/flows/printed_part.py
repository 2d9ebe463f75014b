"""Report of a printed part: height map as a picture, surface in 3D, table of layers."""

import base64
from pathlib import Path

import meshio
import numpy as np

from reflowshock.arrays import Floats
from reflowshock.workflow.case.text import number
from reflowshock.workflow.report.scene import Field, Group, Scene

VIEW = (-0.9, -1.6, 1.1)  # direction towards the viewer
COLUMNS = {
    "layer": "layer", "height_um": "height [µm]", "roughness_sa_um": "Sa [µm]", "roughness_sz_um": "Sz [µm]",
    "volume_pl": "volume [pL]", "parts_so_far": "connected parts", "voids": "voids",
}  # fmt: skip


def draw_heights(path: Path, x: Floats, y: Floats, heights: Floats) -> None:
    """Write the height map as PNG.

    Args:
        path: File to write.
        x: Grid coordinates, shape (i,) [m].
        y: Grid coordinates, shape (j,) [m].
        heights: Height of the part at the grid nodes, shape (i, j) [m].
    """
    from reflowshock.workflow.report.drawing import STYLE, pyplot

    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(figsize=(5.2, 4.4), layout="constrained")
        image = axes.pcolormesh(1e6 * x, 1e6 * y, 1e6 * heights.T, cmap="viridis", shading="nearest")
        axes.set_aspect("equal")
        axes.set_xlabel("x [µm]")
        axes.set_ylabel("y [µm]")
        figure.colorbar(image, label="height [µm]")
        figure.savefig(path, dpi=150, metadata={"Software": None})
        pyplot.close(figure)


def add_part(products: Path, context: dict) -> None:
    """Add height map, surface and table of layers to the context of the report.

    Args:
        products: Folder with the products of the stage ``particles``: ``height_map.png``, ``part.stl``, ``layers.csv``.
        context: Context of the page's template, changed in place: ``pictures``, ``scenes``, ``tables``.
    """
    context["pictures"]["heights"] = base64.b64encode((products / "height_map.png").read_bytes()).decode()
    context["scenes"]["part"] = part_scene(products / "part.stl")
    context["tables"]["part"] = layer_table(products / "layers.csv")


def part_scene(stl: Path) -> Scene:
    """Return the 3D scene of the part's surface, coloured by height.

    Args:
        stl: STL file of the surface, in millimetres.

    Returns:
        Interactive 3D scene for the report page.
    """
    mesh = meshio.read(stl)
    points, vertex = np.unique(1e-3 * mesh.points, axis=0, return_inverse=True)
    faces = vertex.reshape(-1)[mesh.cells[0].data]
    height = 1e6 * points[:, 2]
    part = np.zeros(len(points), dtype=int)
    group = Group("part", points, faces, part, values={"height": height[None]})
    return Scene([group], ["printed part"], [Field("height", "µm", 0.0, float(height.max()))], view=VIEW)


def layer_table(file: Path) -> dict:
    """Return the table of layers; each row describes the part after that layer.

    Args:
        file: CSV file ``layers.csv`` of the stage.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): layer, height, roughness Sa and Sz [µm],
        volume [pL], number of connected parts and of voids.
    """
    head = file.read_text(encoding="utf-8").splitlines()[0].split(",")
    columns = [head.index(name) for name in COLUMNS]
    rows = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)[:, columns]
    return {"head": list(COLUMNS.values()), "rows": [[number(value) for value in row] for row in rows]}
