"""Which rank has which cell: recursive bisection that balances the work of every step level at once."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.mesh.mesh import MeshData

ANGLES = 12  # directions of a cut in the plane of the two largest extents
TILT = 1e-3  # of a direction, so that cells at equal distance are taken row by row
NODE_COST = 0.5  # of the work on a node, what it costs more where several ranks have it


@dataclass(frozen=True, slots=True)
class Cells:
    """What a bisection knows of cells.

    Attributes:
        centres: ``(ne, 3)`` [m].
        nodes: ``(ne, k)`` their nodes.
        work: ``(ne, levels)`` seconds of a window at each step level, whose ranks wait for each other.
        node_work: ``(n,)`` seconds of a window on each node.
    """

    centres: NDArray[np.float64]
    nodes: NDArray[np.int32]
    work: NDArray[np.float64]
    node_work: NDArray[np.float64]

    def subset(self, chosen: NDArray[np.bool_]) -> "Cells":
        """Return some of the cells."""
        return Cells(self.centres[chosen], self.nodes[chosen], self.work[chosen], self.node_work)


def partition(mesh: MeshData, work: NDArray[np.float64], speeds: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return the rank ``(ne,)`` of each cell.

    Ranks are halved again and again, and the cells with them, each time by a plane. Of planes in many directions, each
    of which gives both sides work as their speeds, the one is taken whose slower side is the fastest, all levels added
    up: two measures can always be halved by one line, more of them nearly. Cuts through the thickness of a flat body
    have so many nodes that whole joints stay together.

    Args:
        mesh: The mesh.
        work: ``(ne, levels)`` seconds of a window at each step level.
        speeds: ``(ranks,)``.
    """
    corners = mesh.cells.shape[1]
    shares = np.repeat(work.sum(axis=1) / corners, corners)
    node_work = np.bincount(mesh.cells.ravel(), weights=shares, minlength=len(mesh.points)).astype(float)
    cells = Cells(mesh.points[mesh.cells].mean(axis=1), mesh.cells, work, node_work)
    rank = np.zeros(len(mesh.cells), np.int32)
    assign(cells, np.asarray(speeds, float), 0, rank)
    return rank


def assign(cells: Cells, speeds: NDArray[np.float64], first: int, rank: NDArray[np.int32]) -> None:
    """Write the ranks ``(ne,)`` of cells of the ranks ``first``, ``first + 1``, … with given speeds."""
    if len(speeds) == 1 or len(rank) < len(speeds):
        rank[:] = first + np.arange(len(rank)) % len(speeds)
        return
    middle = len(speeds) // 2
    left = bisect(cells, float(speeds[:middle].sum()), float(speeds[middle:].sum()))
    for side, some, start in ((left, speeds[:middle], first), (~left, speeds[middle:], first + middle)):
        part = np.empty(int(side.sum()), np.int32)
        assign(cells.subset(side), some, start, part)
        rank[side] = part


def bisect(cells: Cells, left: float, right: float) -> NDArray[np.bool_]:
    """Return which cells ``(ne,)`` the left side has, for two sides with given speeds."""
    found = [sweep(cells, direction, left, right) for direction in directions(cells.centres)]
    return min(found, key=lambda item: item[1])[0]


def sweep(cells: Cells, direction: NDArray[np.float64], left: float, right: float) -> tuple[NDArray[np.bool_], float]:
    """Cut across a direction ``(3,)`` so that all work is shared; return the left side and the window [s]."""
    order = np.argsort(cells.centres @ direction, kind="stable")
    done = np.cumsum(cells.work[order].sum(axis=1))
    count = int(np.searchsorted(done, done[-1] * left / (left + right))) + 1
    side = np.zeros(len(order), dtype=bool)
    side[order[: min(max(count, 1), len(order) - 1)]] = True
    levels = np.maximum(cells.work[side].sum(axis=0) / left, cells.work[~side].sum(axis=0) / right)
    shared = np.intersect1d(cells.nodes[side], cells.nodes[~side])
    return side, float(levels.sum() + NODE_COST * cells.node_work[shared].sum() / (left + right))


def directions(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return directions ``(k, 3)`` of cuts: around in the plane of the two largest extents, and across it."""
    axes = np.eye(3)[np.argsort(-np.ptp(points, axis=0))]
    angles = np.pi / ANGLES * np.arange(ANGLES)[:, None]
    around = np.cos(angles) * axes[0] + np.sin(angles) * axes[1]
    beside = np.cos(angles) * axes[1] - np.sin(angles) * axes[0]
    return np.vstack([around + TILT * beside + TILT**2 * axes[2], axes[2] + TILT * axes[0] + TILT**2 * axes[1]])
