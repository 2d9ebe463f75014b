"""Part of a joined mesh that belongs to one model: cells, nodes and ties in its own numbers."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.whole import Whole
from reflowshock.fem.mesh.mesh import MeshData, selected_cells
from reflowshock.fem.mesh.tie import Tie


@dataclass(frozen=True, slots=True)
class Part:
    """Part of a joined mesh that belongs to one model.

    Attributes:
        mesh: Cells, facets and nodes of the part.
        tie: Slaves and all their masters; masters without a cell in the part are numbered after the nodes of the mesh.
        number: Number in the part of each node of the joined mesh, -1 if it is not in the part, shape (n,).
        cell_number: Number in the part of each cell of the joined mesh, -1 if it is not in the part, shape (ne,).
        nodes: Number of nodes, masters without a cell included.
    """

    mesh: MeshData
    tie: Tie
    number: NDArray[np.int32]
    cell_number: NDArray[np.int32]
    nodes: int


def part_of(whole: Whole, cells: NDArray[np.bool_]) -> Part:
    """Return the part of a joined mesh with the selected cells, the slaves among its nodes, and all their masters.

    Args:
        whole: Joined mesh with its ties.
        cells: Selected cells, shape (ne,).

    Returns:
        Mesh and tie in the numbers of the part, and the maps from old to new node and cell numbers (-1 if absent).

    Raises:
        MeshError: No cell is selected.
    """
    mesh, number = selected_cells(whole.mesh, cells)
    mine = number[whole.tie.slave] >= 0
    absent = np.unique(whole.tie.master[mine][number[whole.tie.master[mine]] < 0])
    number[absent] = np.arange(len(mesh.points), len(mesh.points) + len(absent))
    tie = Tie(number[whole.tie.slave[mine]], number[whole.tie.master[mine]], whole.tie.weight[mine])
    cell_number = np.where(cells, np.cumsum(cells) - 1, -1).astype(np.int32)
    return Part(mesh, tie, number, cell_number, len(mesh.points) + len(absent))


def interface_between(whole: Whole, macro: Part, meso: Part) -> NDArray[np.intp]:
    """Return the nodes of the joined mesh that both models share, without slaves, shape (nc,).

    A shared slave follows its masters in both models, so only the masters are coupled.

    Args:
        whole: Joined mesh with its ties.
        macro: Part of the mesh in the macro model, or around the meso model in one-way coupling.
        meso: Part of the mesh in the meso model.
    """
    common = (macro.number >= 0) & (meso.number >= 0)
    common[whole.tie.slave] = False
    return np.flatnonzero(common)
