"""Local part of a mesh distributed by DOLFINx, with the input numbers of its nodes and cells."""

from dataclasses import dataclass

import dolfinx.mesh
import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem import dolfinx_api
from reflowshock.fem.mesh.mesh import MeshData


@dataclass(frozen=True, slots=True)
class LocalMesh:
    """Cells of one rank and all nodes that it uses.

    Attributes:
        mesh: Distributed DOLFINx mesh with the same cells; its nodes may be numbered differently.
        nodes: Input number of each node, shape (n,).
        points: Nodes, shape (n, 3) [m].
        cells: Local nodes of each cell in the order of ``MeshData``, shape (ne, k) int32.
        cell_numbers: Input number of each cell, shape (ne,).
    """

    mesh: dolfinx.mesh.Mesh
    nodes: NDArray[np.int64]
    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    cell_numbers: NDArray[np.int64]

    def locate(self, nodes: NDArray[np.integer]) -> NDArray[np.int32]:
        """Return the local numbers of input nodes, shape (k,), -1 for nodes of other ranks."""
        return positions(self.nodes, nodes)

    def locate_cells(self, cells: NDArray[np.integer]) -> NDArray[np.int32]:
        """Return the local numbers of input cells, shape (k,), -1 for cells of other ranks."""
        return positions(self.cell_numbers, cells)

    def with_nodes(self, nodes: NDArray[np.integer], points: NDArray[np.float64]) -> "LocalMesh":
        """Return the mesh with additional input nodes, shape (k,), such as masters of this rank's slaves."""
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
        """Return the mesh with its nodes reordered by a permutation, shape (n,)."""
        new_number = np.empty(len(order), np.int32)
        new_number[order] = np.arange(len(order))
        return LocalMesh(self.mesh, self.nodes[order], self.points[order], new_number[self.cells], self.cell_numbers)


def positions(haystack: NDArray[np.integer], needles: NDArray[np.integer]) -> NDArray[np.int32]:
    """Return the index in ``haystack`` of each needle, -1 if it is missing, in the shape of ``needles``.

    Args:
        haystack: Unique numbers in any order, shape (n,).
        needles: Numbers to be looked up, shape (k,).
    """
    if not len(haystack):
        return np.full(np.shape(needles), -1, np.int32)
    order = np.argsort(haystack)
    nearest = order[np.minimum(np.searchsorted(haystack, needles, sorter=order), len(haystack) - 1)]
    return np.where(haystack[nearest] == needles, nearest, -1).astype(np.int32)


def distribute(comm: MPI.Comm, data: MeshData | None, ranks: NDArray[np.int32] | None = None) -> LocalMesh:
    """Distribute a mesh from rank 0 of ``comm``; collective.

    Args:
        comm: Communicator of the model.
        data: Mesh on rank 0, None on other ranks.
        ranks: Rank of each cell on rank 0, shape (ne,); None lets DOLFINx partition the mesh.

    Returns:
        Cells of this rank with all their nodes, in local numbers, and the maps to input numbers.
    """
    nodes = comm.bcast(data.shape.nodes if data else None)
    points = data.points if data else np.empty((0, 3))
    cells = data.cells if data else np.empty((0, nodes), np.int64)
    mesh = dolfinx_api.make_mesh(comm, points, cells, _destinations(comm, data, ranks))
    return LocalMesh(
        mesh,
        dolfinx_api.input_nodes(mesh),
        np.ascontiguousarray(mesh.geometry.x, float),
        dolfinx_api.cell_nodes(mesh),
        dolfinx_api.input_cells(mesh),
    )


def _destinations(comm: MPI.Comm, data: MeshData | None, ranks: NDArray[np.int32] | None) -> NDArray[np.int32] | None:
    """Return the prescribed rank of each cell that this rank has before distribution, None without a prescription."""
    chosen = comm.bcast(ranks is not None)
    return (ranks if data else np.empty(0, np.int32)) if chosen else None
