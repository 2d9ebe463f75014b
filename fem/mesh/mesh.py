"""Mesh before partitioning: points, cells of one shape, part names, named facets. Plain NumPy, one process."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import CellShape, shape_of
from reflowshock.fem.errors import MeshError


@dataclass(frozen=True, slots=True)
class MeshData:
    """Mesh of cells of one shape with named parts and facet sets.

    Attributes:
        points: Node coordinates, shape (n, 3) [m].
        cells: Nodes of the cells in the order of DOLFINx (``elements.cell_shape``), shape (ne, k), int32.
        part: Index of each cell's part in ``part_names``, shape (ne,), int32.
        part_names: Names of the parts.
        facets: Facet set name -> nodes of quadrilaterals in cyclic order, or of triangles with mid-edge nodes, shape
            (nf, m), int32.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    part: NDArray[np.int32]
    part_names: tuple[str, ...]
    facets: dict[str, NDArray[np.int32]]

    @property
    def shape(self) -> CellShape:
        """Shape of the cells."""
        return shape_of(self.cells)

    def facets_of(self, name: str) -> NDArray[np.int32]:
        """Return the nodes of a facet set, shape (nf, m), empty if the mesh has no such set."""
        return self.facets.get(name, np.empty((0, self.shape.faces.shape[1]), np.int32))

    def facet_nodes(self, name: str) -> NDArray[np.int32]:
        """Return the sorted nodes of a facet set, each once, empty if the mesh has no such set."""
        return np.unique(self.facets_of(name))

    def in_parts(self, accept: Callable[[str], bool]) -> NDArray[np.bool_]:
        """Return whether the part name of each cell is accepted, shape (ne,)."""
        return np.array([accept(name) for name in self.part_names], dtype=bool)[self.part]


def append(meshes: Sequence[MeshData]) -> MeshData:
    """Concatenate meshes without merging nodes; parts and facet sets of equal name are joined.

    Args:
        meshes: Meshes, at least one; nodes and cells are numbered in this order.

    Raises:
        MeshError: The meshes have cells of different shapes.
    """
    shapes = {mesh.shape.name for mesh in meshes}
    if len(shapes) > 1:
        raise MeshError(f"all meshes of a model need cells of one shape, found {', '.join(sorted(shapes))}")
    names = tuple(dict.fromkeys(name for mesh in meshes for name in mesh.part_names))
    offsets = np.concatenate([[0], np.cumsum([len(mesh.points) for mesh in meshes])]).astype(np.int32)
    number = [np.array([names.index(name) for name in mesh.part_names], np.int32) for mesh in meshes]
    facet_names = dict.fromkeys(name for mesh in meshes for name in mesh.facets)
    return MeshData(
        points=np.concatenate([mesh.points for mesh in meshes]),
        cells=np.concatenate([mesh.cells + offset for mesh, offset in zip(meshes, offsets[:-1], strict=True)]),
        part=np.concatenate([numbers[mesh.part] for numbers, mesh in zip(number, meshes, strict=True)]),
        part_names=names,
        facets={
            name: np.concatenate(
                [
                    mesh.facets[name] + offset
                    for mesh, offset in zip(meshes, offsets[:-1], strict=True)
                    if name in mesh.facets
                ]
            )
            for name in facet_names
        },
    )


def without_unused_nodes(data: MeshData) -> tuple[MeshData, NDArray[np.int32]]:
    """Drop the nodes that belong to no cell, and the facets with such a node.

    Args:
        data: The mesh, with n nodes.

    Returns:
        The mesh, and the new number of each old node, -1 for dropped nodes, shape (n,).
    """
    used = np.zeros(len(data.points), dtype=bool)
    used[data.cells] = True
    number = np.where(used, np.cumsum(used) - 1, -1).astype(np.int32)
    facets = {name: number[quads[used[quads].all(axis=1)]] for name, quads in data.facets.items()}
    return MeshData(data.points[used], number[data.cells], data.part, data.part_names, facets), number


def select(data: MeshData, accept: Callable[[str], bool]) -> tuple[MeshData, NDArray[np.int32]]:
    """Extract all parts whose name is accepted as a mesh.

    Args:
        data: Mesh with named parts.
        accept: Function from a part name to whether the part is extracted.

    Returns:
        The mesh, and the new number of each old node, -1 for dropped nodes, shape (n,).

    Raises:
        MeshError: No cell is extracted.
    """
    return selected_cells(data, data.in_parts(accept))


def selected_cells(data: MeshData, chosen: NDArray[np.bool_]) -> tuple[MeshData, NDArray[np.int32]]:
    """Extract the chosen cells, with their nodes and the facets on these nodes, as a mesh.

    Args:
        data: The mesh.
        chosen: Whether each cell is extracted, shape (ne,).

    Returns:
        The mesh, and the new number of each old node, -1 for dropped nodes, shape (n,).

    Raises:
        MeshError: No cell is chosen.
    """
    if not chosen.any():
        raise MeshError(f"no cell belongs to the chosen parts; the mesh has {', '.join(data.part_names)}")
    return without_unused_nodes(
        MeshData(data.points, data.cells[chosen], data.part[chosen], data.part_names, data.facets)
    )


def merge_nodes(
    data: MeshData, duplicates: NDArray[np.int32], originals: NDArray[np.int32]
) -> tuple[MeshData, NDArray[np.int32]]:
    """Replace duplicate nodes by their originals in cells and facets, and drop them.

    Args:
        data: The mesh.
        duplicates: Nodes to be replaced, shape (k,).
        originals: Node that replaces each of them, shape (k,).

    Returns:
        The mesh, and the new number of each old node, shape (n,): that of its original for a duplicate, -1 for nodes
        without a cell, which are dropped, too.
    """
    number = np.arange(len(data.points), dtype=np.int32)
    number[duplicates] = originals
    facets = {name: number[quads] for name, quads in data.facets.items()}
    merged, new = without_unused_nodes(MeshData(data.points, number[data.cells], data.part, data.part_names, facets))
    return merged, new[number]


def boundary_facets(cells: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the faces that belong to one cell only, shape (nf, m), nodes in the order of ``CellShape.faces``.

    Args:
        cells: Nodes of each cell, shape (ne, k).
    """
    local = shape_of(cells).faces
    faces = cells[:, local].reshape(-1, local.shape[1])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def cells_of_facets(cells: NDArray[np.int32], facets: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return the first cell that contains each facet, -1 if no cell does, shape (nf,).

    Args:
        cells: Nodes of each cell, shape (ne, k).
        facets: Nodes of each facet in any order, shape (nf, m).
    """
    local = shape_of(cells).faces
    faces = np.sort(cells[:, local].reshape(-1, local.shape[1]), axis=1)
    _, label = np.unique(np.concatenate([faces, np.sort(facets, axis=1)]), axis=0, return_inverse=True)
    label = label.reshape(-1)
    owner = np.full(int(label.max(initial=-1)) + 1, -1, np.int64)
    owner[label[: len(faces)][::-1]] = np.repeat(np.arange(len(cells)), len(local))[::-1]
    return owner[label[len(faces) :]]
