"""The mesh as the files hold it: points, hexahedra, part names, named facets. Plain NumPy, one process."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

from fem.errors import MeshError

# Gmsh and VTK number a hexahedron around its faces; here, as in DOLFINx, bit d of a local index is the side in
# direction d.
TENSOR_ORDER = np.array([0, 1, 3, 2, 4, 5, 7, 6])
FACES = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 3, 6, 7], [0, 2, 4, 6], [1, 3, 5, 7]])


@dataclass(frozen=True, slots=True)
class MeshData:
    """Hexahedra with named parts and named facets.

    Attributes:
        points: ``(n, 3)`` [m].
        cells: ``(ne, 8)`` int32, tensor order (``TENSOR_ORDER``).
        part: ``(ne,)`` int32, index into ``part_names``.
        part_names: Names of the parts.
        facets: Name -> ``(nf, 4)`` int32 quadrilaterals in cyclic order.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    part: NDArray[np.int32]
    part_names: tuple[str, ...]
    facets: dict[str, NDArray[np.int32]]

    def facet_nodes(self, name: str) -> NDArray[np.int32]:
        """Return the sorted nodes of a facet set, empty where the mesh has no such set."""
        return np.unique(self.facets.get(name, np.empty((0, 4), np.int32)))

    def in_parts(self, accept: Callable[[str], bool]) -> NDArray[np.bool_]:
        """Return ``(ne,)``: whether the name of a cell's part is accepted."""
        return np.array([accept(name) for name in self.part_names], dtype=bool)[self.part]


def read_meshes(paths: Sequence[Path]) -> MeshData:
    """Read Gmsh files and append them into one mesh; the pieces share no node."""
    return append([read_mesh(path) for path in paths])


def read_mesh(path: Path) -> MeshData:
    """Read one Gmsh 4.1 file.

    Raises:
        MeshError: The file has no hexahedra, other cells of dimension three, or a hexahedron in no or several volumes.
    """
    mesh = meshio.read(path, file_format="gmsh")
    foreign = {block.type for block in mesh.cells if block.dim == 3 and block.type != "hexahedron"}
    blocks = [index for index, block in enumerate(mesh.cells) if block.type == "hexahedron"]
    if foreign or not blocks:
        raise MeshError(f"{path}: hexahedra are needed, found {sorted(foreign) or 'no volume cells'}")
    names = tuple(name for name, (_, dimension) in mesh.field_data.items() if dimension == 3)
    part = np.concatenate([part_of_block(mesh, index, names, path) for index in blocks])
    cells = np.concatenate([mesh.cells[index].data for index in blocks])[:, TENSOR_ORDER]
    quads = [index for index, block in enumerate(mesh.cells) if block.type == "quad"]
    facets = {
        name: np.concatenate([mesh.cells[k].data[mesh.cell_sets[name][k]] for k in quads]).astype(np.int32)
        for name, (_, dimension) in mesh.field_data.items()
        if dimension == 2 and quads
    }
    return without_unused_nodes(
        MeshData(np.ascontiguousarray(mesh.points, float), cells.astype(np.int32), part.astype(np.int32), names, facets)
    )[0]


def part_of_block(mesh: meshio.Mesh, index: int, names: tuple[str, ...], path: Path) -> NDArray[np.int64]:
    """Return the part of each cell of one block; see ``read_mesh`` for the errors."""
    owners = [k for k, name in enumerate(names) if len(mesh.cell_sets[name][index])]
    if len(owners) != 1:
        found = [names[k] for k in owners] or "no physical volume"
        raise MeshError(f"{path}: hexahedra must belong to exactly one physical volume, block {index} is in {found}")
    return np.full(len(mesh.cells[index].data), owners[0])


def append(pieces: Sequence[MeshData]) -> MeshData:
    """Append meshes into one; parts and facet sets of equal name become one."""
    names = tuple(dict.fromkeys(name for piece in pieces for name in piece.part_names))
    offsets = np.concatenate([[0], np.cumsum([len(piece.points) for piece in pieces])]).astype(np.int32)
    number = [np.array([names.index(name) for name in piece.part_names], np.int32) for piece in pieces]
    facet_names = dict.fromkeys(name for piece in pieces for name in piece.facets)
    return MeshData(
        points=np.concatenate([piece.points for piece in pieces]),
        cells=np.concatenate([piece.cells + offset for piece, offset in zip(pieces, offsets[:-1], strict=True)]),
        part=np.concatenate([numbers[piece.part] for numbers, piece in zip(number, pieces, strict=True)]),
        part_names=names,
        facets={
            name: np.concatenate(
                [
                    piece.facets[name] + offset
                    for piece, offset in zip(pieces, offsets[:-1], strict=True)
                    if name in piece.facets
                ]
            )
            for name in facet_names
        },
    )


def without_unused_nodes(data: MeshData) -> tuple[MeshData, NDArray[np.int32]]:
    """Drop the nodes that no cell has, and the facets with such a node.

    Returns:
        The mesh, and the new number of each old node, -1 for those that went.
    """
    used = np.zeros(len(data.points), dtype=bool)
    used[data.cells] = True
    number = np.where(used, np.cumsum(used) - 1, -1).astype(np.int32)
    facets = {name: number[quads[used[quads].all(axis=1)]] for name, quads in data.facets.items()}
    return MeshData(data.points[used], number[data.cells], data.part, data.part_names, facets), number


def select(data: MeshData, accept: Callable[[str], bool]) -> tuple[MeshData, NDArray[np.int32]]:
    """Make the parts whose names are accepted a mesh of their own; returns as ``without_unused_nodes``.

    Raises:
        MeshError: No cell is left.
    """
    chosen = data.in_parts(accept)
    if not chosen.any():
        raise MeshError(f"no cell belongs to the chosen parts; the mesh has {', '.join(data.part_names)}")
    return without_unused_nodes(
        MeshData(data.points, data.cells[chosen], data.part[chosen], data.part_names, data.facets)
    )


def merge_nodes(
    data: MeshData, duplicates: NDArray[np.int32], originals: NDArray[np.int32]
) -> tuple[MeshData, NDArray[np.int32]]:
    """Replace each node of ``duplicates`` by the one of ``originals``; returns as ``without_unused_nodes``."""
    number = np.arange(len(data.points), dtype=np.int32)
    number[duplicates] = originals
    facets = {name: number[quads] for name, quads in data.facets.items()}
    merged, kept = without_unused_nodes(MeshData(data.points, number[data.cells], data.part, data.part_names, facets))
    return merged, kept[number]


def boundary_facets(cells: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the faces that belong to one cell only: ``(nf, 4)``, nodes in tensor order."""
    faces = cells[:, FACES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def cells_of_facets(cells: NDArray[np.int32], facets: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return the first cell (among ``cells``) that has each facet: ``(nf,)``, -1 where none has it."""
    faces = np.sort(cells[:, FACES].reshape(-1, 4), axis=1)
    _, label = np.unique(np.concatenate([faces, np.sort(facets, axis=1)]), axis=0, return_inverse=True)
    label = label.reshape(-1)
    owner = np.full(int(label.max(initial=-1)) + 1, -1, np.int64)
    owner[label[: len(faces)][::-1]] = np.repeat(np.arange(len(cells)), len(FACES))[::-1]
    return owner[label[len(faces) :]]
