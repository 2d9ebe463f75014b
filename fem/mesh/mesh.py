"""A mesh before it is distributed: points, cells of one shape, part names, named facets. Plain NumPy, one process."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import CellShape, shape_of
from reflowshock.fem.errors import MeshError


@dataclass(frozen=True, slots=True)
class MeshData:
    """Cells of one shape with named parts and named facets.

    Attributes:
        points: ``(n, 3)`` [m].
        cells: ``(ne, k)`` int32, node order of DOLFINx (``elements.cell_shape``).
        part: ``(ne,)`` int32, index into ``part_names``.
        part_names: Names of the parts.
        facets: Name -> ``(nf, m)`` int32: quadrilaterals in cyclic order, or triangles with their edges' nodes.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    part: NDArray[np.int32]
    part_names: tuple[str, ...]
    facets: dict[str, NDArray[np.int32]]

    @property
    def shape(self) -> CellShape:
        """Return the shape of the cells."""
        return shape_of(self.cells)

    def facets_of(self, name: str) -> NDArray[np.int32]:
        """Return a facet set ``(nf, m)``, empty where the mesh has no such set."""
        return self.facets.get(name, np.empty((0, self.shape.faces.shape[1]), np.int32))

    def facet_nodes(self, name: str) -> NDArray[np.int32]:
        """Return the sorted nodes of a facet set, empty where the mesh has no such set."""
        return np.unique(self.facets_of(name))

    def in_parts(self, accept: Callable[[str], bool]) -> NDArray[np.bool_]:
        """Return ``(ne,)``: whether the name of a cell's part is accepted."""
        return np.array([accept(name) for name in self.part_names], dtype=bool)[self.part]


def append(pieces: Sequence[MeshData]) -> MeshData:
    """Append meshes into one; parts and facet sets of equal name become one.

    Raises:
        MeshError: The meshes have cells of different shapes.
    """
    shapes = {piece.shape.name for piece in pieces}
    if len(shapes) > 1:
        raise MeshError(f"all meshes of a model need cells of one shape, found {', '.join(sorted(shapes))}")
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
    """Make the parts whose names are accepted a mesh of their own; returns and errors as ``selected_cells``."""
    return selected_cells(data, data.in_parts(accept))


def selected_cells(data: MeshData, chosen: NDArray[np.bool_]) -> tuple[MeshData, NDArray[np.int32]]:
    """Make the chosen cells ``(ne,)`` a mesh of their own; returns as ``without_unused_nodes``.

    Raises:
        MeshError: No cell is left.
    """
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
    """Return the faces that belong to one cell only: ``(nf, m)``, nodes as in ``CellShape.faces``."""
    local = shape_of(cells).faces
    faces = cells[:, local].reshape(-1, local.shape[1])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def cells_of_facets(cells: NDArray[np.int32], facets: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return the first cell (among ``cells``) that has each facet: ``(nf,)``, -1 where none has it."""
    local = shape_of(cells).faces
    faces = np.sort(cells[:, local].reshape(-1, local.shape[1]), axis=1)
    _, label = np.unique(np.concatenate([faces, np.sort(facets, axis=1)]), axis=0, return_inverse=True)
    label = label.reshape(-1)
    owner = np.full(int(label.max(initial=-1)) + 1, -1, np.int64)
    owner[label[: len(faces)][::-1]] = np.repeat(np.arange(len(cells)), len(local))[::-1]
    return owner[label[len(faces) :]]
