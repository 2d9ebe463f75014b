"""Meshes read from Gmsh files, with a check of the cells by their scaled Jacobian."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import HEXAHEDRON, SHAPES, CellShape
from reflowshock.fem.elements.tetrahedron import EDGES
from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import MeshData, append, without_unused_nodes

if TYPE_CHECKING:
    import meshio

# Three neighbours of each vertex, right-handed.
OF_HEXAHEDRON = np.array(
    [[a ^ 1, a ^ 2, a ^ 4] if bin(a).count("1") % 2 == 0 else [a ^ 2, a ^ 1, a ^ 4] for a in range(8)]
)
OF_TETRAHEDRON = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
MIDDLE = np.full((4, 4), -1)
MIDDLE[EDGES[:, 0], EDGES[:, 1]] = MIDDLE[EDGES[:, 1], EDGES[:, 0]] = 4 + np.arange(6)


def read_meshes(paths: Sequence[Path]) -> MeshData:
    """Read Gmsh 4.1 files and concatenate them into one mesh without merging nodes.

    Parts and facet sets of equal name are joined.

    Args:
        paths: Files, at least one.

    Raises:
        MeshError: A file has no usable cells (see ``read_mesh``), or the files have cells of different shapes.
    """
    return append([read_mesh(path) for path in paths])


def read_mesh(path: Path) -> MeshData:
    """Read one Gmsh 4.1 file as a mesh whose parts are its physical volumes and whose facet sets its physical surfaces.

    Args:
        path: File to be read.

    Raises:
        MeshError: The file has no cells of a supported shape, several shapes, a cell in no or several volumes, or a
            cell that is too distorted (``_check_quality``).
    """
    import meshio

    mesh = meshio.read(path, file_format="gmsh")
    shape = _shape_in_file(mesh, path)
    blocks = [index for index, block in enumerate(mesh.cells) if block.type == shape.name]
    names = tuple(name for name, (_, dimension) in mesh.field_data.items() if dimension == 3)
    part = np.concatenate([_part_of_block(mesh, index, names, path) for index in blocks])
    cells = np.concatenate([mesh.cells[index].data for index in blocks])[:, shape.order]
    faces = [index for index, block in enumerate(mesh.cells) if block.type == shape.facet]
    facets = {
        name: np.concatenate([mesh.cells[k].data[mesh.cell_sets[name][k]] for k in faces]).astype(np.int32)
        for name, (_, dimension) in mesh.field_data.items()
        if dimension == 2 and faces
    }
    points = np.ascontiguousarray(mesh.points, float)
    data = MeshData(points, cells.astype(np.int32), part.astype(np.int32), names, facets)
    _check_quality(data)
    return without_unused_nodes(data)[0]


def _shape_in_file(mesh: "meshio.Mesh", path: Path) -> CellShape:
    """Return the one shape of the cells in a file; see ``read_mesh`` for the errors."""
    types = {block.type for block in mesh.cells if block.dim == 3}
    supported = {shape.name: shape for shape in SHAPES.values()}
    if len(types) != 1 or not types <= set(supported):
        kinds = ", ".join(sorted(types)) or "no volume cells"
        raise MeshError(f"{path}: cells of one shape are needed ({', '.join(supported)}), found {kinds}")
    return supported[types.pop()]


def _part_of_block(mesh: "meshio.Mesh", index: int, names: tuple[str, ...], path: Path) -> NDArray[np.int64]:
    """Return the part of each cell of one block; see ``read_mesh`` for the errors."""
    owners = [k for k, name in enumerate(names) if len(mesh.cell_sets[name][index])]
    if len(owners) != 1:
        volumes = [names[k] for k in owners] or "no physical volume"
        raise MeshError(f"{path}: cells must belong to exactly one physical volume, block {index} is in {volumes}")
    return np.full(len(mesh.cells[index].data), owners[0])


def scaled_jacobians(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the smallest scaled Jacobian of cells, shape (ne,): 1 for cubes and regular tetrahedra.

    It is the triple product of the unit tangents of the three edges at a vertex (Knupp, Verdict); 0 if an edge has no
    length.

    Args:
        corners: Node coordinates of the cells, shape (ne, k, 3) [m].
    """
    nodes = corners.shape[1]
    neighbours = OF_HEXAHEDRON if nodes == HEXAHEDRON.nodes else OF_TETRAHEDRON
    vertices = np.arange(len(neighbours))
    edges = corners[:, neighbours] - corners[:, vertices, None]
    if nodes == 10:  # the tangent at an end of a parabola
        middle = corners[:, MIDDLE[vertices[:, None], neighbours]]
        edges = 4.0 * middle - corners[:, neighbours] - 3.0 * corners[:, vertices, None]
    lengths = np.linalg.norm(edges, axis=3).prod(axis=2)
    regular = 1.0 if nodes == HEXAHEDRON.nodes else np.sqrt(2.0)
    spanned = regular * np.linalg.det(edges)
    return np.divide(spanned, lengths, out=np.zeros_like(spanned), where=lengths > 0.0).min(axis=1)


def _check_quality(mesh: MeshData) -> None:
    """Check that the scaled Jacobian of every cell is large enough for an element.

    Raises:
        MeshError: A cell is distorted or inverted; the message gives number, part and position of the worst one.
    """
    quality, limit = scaled_jacobians(mesh.points[mesh.cells]), mesh.shape.lowest_quality
    worst = int(np.argmin(quality))
    if quality[worst] >= limit:
        return
    fault = "too distorted"
    if quality[worst] < 1e-12:
        fault = "without volume" if quality[worst] > -1e-12 else "turned inside out"
    position = ", ".join(f"{value:.6g}" for value in mesh.points[mesh.cells[worst]].mean(axis=0))
    raise MeshError(
        f"element {worst} of part {mesh.part_names[mesh.part[worst]]} at ({position}) m is {fault}: scaled Jacobian"
        f" {quality[worst]:.3g}, allowed {limit:g} to 1; {np.sum(quality < limit)} of {len(quality)} elements are below"
    )
