"""A rank's share of a mesh: DOLFINx partitions it, input numbers lead back to parts, facets and tables."""

from dataclasses import dataclass

import dolfinx.mesh
import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem import dolfinx_api
from reflowshock.fem.mesh.mesh import MeshData


@dataclass(frozen=True, slots=True)
class LocalMesh:
    """The cells of one rank and all nodes that it computes with.

    Attributes:
        mesh: The distributed mesh; its cells are those here, its nodes may have other numbers.
        nodes: ``(n,)`` input node numbers.
        points: ``(n, 3)`` [m].
        cells: ``(ne, k)`` int32 local nodes, order as in ``MeshData``.
        cell_numbers: ``(ne,)`` input cell numbers.
    """

    mesh: dolfinx.mesh.Mesh
    nodes: NDArray[np.int64]
    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    cell_numbers: NDArray[np.int64]

    def locate(self, nodes: NDArray[np.integer]) -> NDArray[np.int32]:
        """Return the local numbers of input nodes ``(k,)``, -1 for those of other ranks."""
        return positions(self.nodes, nodes)

    def locate_cells(self, cells: NDArray[np.integer]) -> NDArray[np.int32]:
        """Return the local numbers of input cells ``(k,)``, -1 for those of other ranks."""
        return positions(self.cell_numbers, cells)

    def with_nodes(self, nodes: NDArray[np.integer], points: NDArray[np.float64]) -> "LocalMesh":
        """Append the input nodes among ``nodes (k,)`` that this rank has no cell of (masters of its slaves)."""
        nodes, first = np.unique(nodes, return_index=True)
        new = self.locate(nodes) < 0
        return LocalMesh(
            self.mesh,
            np.concatenate([self.nodes, nodes[new].astype(np.int64)]),
            np.concatenate([self.points, points[first[new]]]),
            self.cells,
            self.cell_numbers,
        )

    def reordered(self, order: NDArray[np.integer]) -> "LocalMesh":
        """Return the same mesh with its nodes in another ``order (n,)``."""
        place = np.empty(len(order), np.int32)
        place[order] = np.arange(len(order))
        return LocalMesh(self.mesh, self.nodes[order], self.points[order], place[self.cells], self.cell_numbers)


def positions(haystack: NDArray[np.integer], needles: NDArray[np.integer]) -> NDArray[np.int32]:
    """Return the position of each needle in the haystack (unique numbers), -1 where it is not there."""
    if not len(haystack):
        return np.full(np.shape(needles), -1, np.int32)
    order = np.argsort(haystack)
    found = order[np.minimum(np.searchsorted(haystack, needles, sorter=order), len(haystack) - 1)]
    return np.where(haystack[found] == needles, found, -1).astype(np.int32)


def distribute(comm: MPI.Comm, data: MeshData | None, ranks: NDArray[np.int32] | None = None) -> LocalMesh:
    """Partition a mesh that rank 0 of ``comm`` holds; collective.

    Args:
        comm: Communicator of the model.
        data: The mesh on rank 0.
        ranks: ``(ne,)`` rank of each cell, on rank 0; without it DOLFINx chooses.
    """
    nodes = comm.bcast(data.shape.nodes if data else None)
    points = data.points if data else np.empty((0, 3))
    cells = data.cells if data else np.empty((0, nodes), np.int64)
    mesh = dolfinx_api.make_mesh(comm, points, cells, destinations(comm, data, ranks))
    return LocalMesh(
        mesh,
        dolfinx_api.input_nodes(mesh),
        np.ascontiguousarray(mesh.geometry.x, float),
        dolfinx_api.cell_nodes(mesh),
        dolfinx_api.input_cells(mesh),
    )


def destinations(comm: MPI.Comm, data: MeshData | None, ranks: NDArray[np.int32] | None) -> NDArray[np.int32] | None:
    """Return the rank of each cell that this rank holds before the mesh is distributed; None if none has a say."""
    chosen = comm.bcast(ranks is not None)
    return (ranks if data else np.empty(0, np.int32)) if chosen else None
