"""Meshes from Gmsh files."""

from collections.abc import Sequence
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import SHAPES, CellShape
from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import MeshData, append, without_unused_nodes
from reflowshock.fem.mesh.mesh_quality import check_quality


def read_meshes(paths: Sequence[Path]) -> MeshData:
    """Read Gmsh files and append them into one mesh; the pieces share no node."""
    return append([read_mesh(path) for path in paths])


def read_mesh(path: Path) -> MeshData:
    """Read one Gmsh 4.1 file.

    Raises:
        MeshError: The file has no cells of a known shape, several shapes, a cell in no or several volumes, or one
            that no element can be made of (``mesh_quality``).
    """
    mesh = meshio.read(path, file_format="gmsh")
    shape = shape_in_file(mesh, path)
    blocks = [index for index, block in enumerate(mesh.cells) if block.type == shape.name]
    names = tuple(name for name, (_, dimension) in mesh.field_data.items() if dimension == 3)
    part = np.concatenate([part_of_block(mesh, index, names, path) for index in blocks])
    cells = np.concatenate([mesh.cells[index].data for index in blocks])[:, shape.order]
    faces = [index for index, block in enumerate(mesh.cells) if block.type == shape.facet]
    facets = {
        name: np.concatenate([mesh.cells[k].data[mesh.cell_sets[name][k]] for k in faces]).astype(np.int32)
        for name, (_, dimension) in mesh.field_data.items()
        if dimension == 2 and faces
    }
    points = np.ascontiguousarray(mesh.points, float)
    data = MeshData(points, cells.astype(np.int32), part.astype(np.int32), names, facets)
    check_quality(data)
    return without_unused_nodes(data)[0]


def shape_in_file(mesh: meshio.Mesh, path: Path) -> CellShape:
    """Return the one shape of the cells in a file; see ``read_mesh`` for the errors."""
    found = {block.type for block in mesh.cells if block.dim == 3}
    known = {shape.name: shape for shape in SHAPES.values()}
    if len(found) != 1 or not found <= set(known):
        kinds = ", ".join(sorted(found)) or "no volume cells"
        raise MeshError(f"{path}: cells of one shape are needed ({', '.join(known)}), found {kinds}")
    return known[found.pop()]


def part_of_block(mesh: meshio.Mesh, index: int, names: tuple[str, ...], path: Path) -> NDArray[np.int64]:
    """Return the part of each cell of one block; see ``read_mesh`` for the errors."""
    owners = [k for k, name in enumerate(names) if len(mesh.cell_sets[name][index])]
    if len(owners) != 1:
        found = [names[k] for k in owners] or "no physical volume"
        raise MeshError(f"{path}: cells must belong to exactly one physical volume, block {index} is in {found}")
    return np.full(len(mesh.cells[index].data), owners[0])
