"""Rows of equal boxes along lines of nodes, the order in which the kernels compute their force."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.kernels.box_rows import LONGEST

SAME_PLANE = 1e-9  # tolerance over the extent of the model


@dataclass(frozen=True, slots=True)
class BoxRows:
    """Lines of nodes and rows of boxes between them; see ``kernels.box_rows.add_row_forces``.

    Attributes:
        nodes: Node at each position, shape (p,) int32; nodes of a line are consecutive.
        rows: Positions of the four low corners of the first box, number of boxes and class, shape (nr, 6) int32.
    """

    nodes: NDArray[np.int32]
    rows: NDArray[np.int32]

    @classmethod
    def find(cls, points: NDArray[np.float64], cells: NDArray[np.int32], shape: NDArray[np.int32]) -> "BoxRows":
        """Return the rows along the first coordinate.

        Args:
            points: Nodes, shape (n, 3) [m].
            cells: Boxes, shape (ne, 8); bit d of a local index is the side in coordinate direction d.
            shape: Class of each box, shape (ne,); all boxes of a row have the same class.
        """
        nodes = lines(points, cells)
        position = np.full(len(points), -1)
        position[nodes] = np.arange(len(nodes))
        corners = position[cells]
        in_line = (corners[:, 1::2] == corners[:, ::2] + 1).all(axis=1)
        rows = runs(corners[in_line, ::2], shape[in_line])
        apart = cells[~in_line]  # boxes at a node with two successors (non-matching meshes) get separate lines
        starts = len(nodes) + 8 * np.arange(len(apart))[:, None] + np.arange(0, 8, 2)
        single = np.column_stack([starts, np.ones(len(apart)), shape[~in_line]])
        return cls(
            np.concatenate([nodes, apart.ravel()]).astype(np.int32), np.concatenate([rows, single]).astype(np.int32)
        )


def lines(points: NDArray[np.float64], cells: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return each node of boxes once, line by line along x (ascending), lines sorted by z, then y, shape (p,).

    Args:
        points: Nodes, shape (n, 3) [m].
        cells: Boxes, shape (ne, 8); bit d of a local index is the side in coordinate direction d.
    """
    first = np.arange(len(points))
    first[cells[:, 1::2].ravel()] = cells[:, ::2].ravel()
    while np.any(first != first[first]):
        first = first[first]
    used = np.unique(cells)
    plane = np.round(points[first[used], 1:] / (SAME_PLANE * np.ptp(points, axis=0).max()))
    return used[np.lexsort((points[used, 0], first[used], plane[:, 0], plane[:, 1]))]


def runs(starts: NDArray[np.int64], shape: NDArray[np.int32]) -> NDArray[np.int64]:
    """Join consecutive boxes of equal class into rows of at most ``LONGEST`` boxes.

    Args:
        starts: Positions in the lines of the four corners at low x of each box, shape (ne, 4); consecutive boxes are
            those at which all four grow by one.
        shape: Class of each box, shape (ne,).

    Returns:
        Positions of the four low corners of the first box of each row, number of boxes, class; shape (nr, 6).
    """
    order = np.argsort(starts[:, 0], kind="stable")
    starts, shape = starts[order], shape[order]
    begins = np.ones(len(starts), dtype=bool)
    begins[1:] = (np.diff(starts, axis=0) != 1).any(axis=1) | (np.diff(shape) != 0)
    begin = np.flatnonzero(begins)
    along = np.arange(len(starts)) - begin[np.cumsum(begins) - 1]
    begin = np.flatnonzero(along % LONGEST == 0)
    count = np.diff(np.append(begin, len(starts)))
    return np.column_stack([starts[begin], count, shape[begin]])
