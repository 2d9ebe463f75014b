"""The part of a whole mesh that one model has: its cells, nodes, ties, in its own numbers."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.whole import Whole
from reflowshock.fem.mesh.mesh import MeshData, selected_cells
from reflowshock.fem.mesh.tie import Tie


@dataclass(frozen=True, slots=True)
class Part:
    """A model's part of a whole mesh.

    Attributes:
        mesh: Its cells, facets and their nodes.
        tie: Its slaves and all their masters: those that it has no cell of are numbered after the nodes of the mesh.
        number: ``(n,)`` own number of each node of the whole mesh, -1 where it has none.
        cell_number: ``(ne,)`` the same of each cell.
        nodes: Number of its nodes, masters without a cell included.
    """

    mesh: MeshData
    tie: Tie
    number: NDArray[np.int32]
    cell_number: NDArray[np.int32]
    nodes: int


def part_of(whole: Whole, cells: NDArray[np.bool_]) -> Part:
    """Return the part of a mesh that has some of its cells ``(ne,)``.

    Raises:
        MeshError: No cell is left.
    """
    mesh, number = selected_cells(whole.mesh, cells)
    mine = number[whole.tie.slave] >= 0
    absent = np.unique(whole.tie.master[mine][number[whole.tie.master[mine]] < 0])
    number[absent] = np.arange(len(mesh.points), len(mesh.points) + len(absent))
    tie = Tie(number[whole.tie.slave[mine]], number[whole.tie.master[mine]], whole.tie.weight[mine])
    cell_number = np.where(cells, np.cumsum(cells) - 1, -1).astype(np.int32)
    return Part(mesh, tie, number, cell_number, len(mesh.points) + len(absent))


def interface_between(whole: Whole, macro: Part, meso: Part) -> NDArray[np.intp]:
    """Return the nodes ``(nc,)`` of the whole mesh that both models have and that move on their own.

    A slave that both have follows its masters in both: they are the nodes that couple.
    """
    common = (macro.number >= 0) & (meso.number >= 0)
    common[whole.tie.slave] = False
    return np.flatnonzero(common)
