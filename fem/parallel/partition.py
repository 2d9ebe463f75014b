"""Partition of cells into ranks by recursive coordinate bisection that balances the work of every step level."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.mesh.mesh import MeshData

ANGLES = 12  # directions of a cut in the plane of the two largest extents
TILT = 1e-3  # tilt of a direction, so that cells at equal distance are sorted row by row
NODE_COST = 0.5  # extra cost of a shared node, as a fraction of its work


@dataclass(frozen=True, slots=True)
class Cells:
    """Positions, nodes and work of the cells to be bisected.

    Attributes:
        centres: Centres of the cells, shape (ne, 3) [m].
        nodes: Nodes of the cells, shape (ne, k).
        work: Time per window at each step level, at which ranks synchronise, shape (ne, levels) [s].
        node_work: Time per window on each node, shape (n,) [s].
    """

    centres: NDArray[np.float64]
    nodes: NDArray[np.int32]
    work: NDArray[np.float64]
    node_work: NDArray[np.float64]

    def subset(self, chosen: NDArray[np.bool_]) -> "Cells":
        """Return the selected cells."""
        return Cells(self.centres[chosen], self.nodes[chosen], self.work[chosen], self.node_work)


def partition(mesh: MeshData, work: NDArray[np.float64], speeds: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return the rank of each cell, shape (ne,).

    Ranks and cells are halved recursively by planes. Each candidate plane divides the total work in the ratio of the
    speeds of both sides; the chosen direction minimises the time of the slower side, summed over the levels, plus the
    cost of shared nodes. A line can always halve two measures (ham sandwich theorem) and nearly halves more. Cuts
    parallel to a flat body have so many nodes that whole joints stay together.

    Args:
        mesh: Mesh to be partitioned.
        work: Time per window of each cell at each step level, shape (ne, levels) [s].
        speeds: Relative speed of each rank, shape (ranks,).
    """
    corners = mesh.cells.shape[1]
    shares = np.repeat(work.sum(axis=1) / corners, corners)
    node_work = np.bincount(mesh.cells.ravel(), weights=shares, minlength=len(mesh.points)).astype(float)
    cells = Cells(mesh.points[mesh.cells].mean(axis=1), mesh.cells, work, node_work)
    rank = np.zeros(len(mesh.cells), np.int32)
    _assign(cells, np.asarray(speeds, float), 0, rank)
    return rank


def _assign(cells: Cells, speeds: NDArray[np.float64], first: int, rank: NDArray[np.int32]) -> None:
    """Write the rank of each cell, shape (ne,), for consecutive ranks from ``first`` on with given speeds."""
    if len(speeds) == 1 or len(rank) < len(speeds):
        rank[:] = first + np.arange(len(rank)) % len(speeds)
        return
    middle = len(speeds) // 2
    left = _bisect(cells, float(speeds[:middle].sum()), float(speeds[middle:].sum()))
    for side, side_speeds, start in ((left, speeds[:middle], first), (~left, speeds[middle:], first + middle)):
        part = np.empty(int(side.sum()), np.int32)
        _assign(cells.subset(side), side_speeds, start, part)
        rank[side] = part


def _bisect(cells: Cells, left: float, right: float) -> NDArray[np.bool_]:
    """Return which cells are on the left side, shape (ne,), for the speeds of both sides."""
    cuts = [_sweep(cells, direction, left, right) for direction in _directions(cells.centres)]
    return min(cuts, key=lambda cut: cut[1])[0]


def _sweep(cells: Cells, direction: NDArray[np.float64], left: float, right: float) -> tuple[NDArray[np.bool_], float]:
    """Cut normal to a direction, shape (3,), in the ratio of the speeds; return left side and window time [s]."""
    order = np.argsort(cells.centres @ direction, kind="stable")
    cumulative = np.cumsum(cells.work[order].sum(axis=1))
    count = int(np.searchsorted(cumulative, cumulative[-1] * left / (left + right))) + 1
    side = np.zeros(len(order), dtype=bool)
    side[order[: min(max(count, 1), len(order) - 1)]] = True
    levels = np.maximum(cells.work[side].sum(axis=0) / left, cells.work[~side].sum(axis=0) / right)
    shared = np.intersect1d(cells.nodes[side], cells.nodes[~side])
    return side, float(levels.sum() + NODE_COST * cells.node_work[shared].sum() / (left + right))


def _directions(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return cut directions, shape (k, 3): several in the plane of the two largest extents, and its normal."""
    axes = np.eye(3)[np.argsort(-np.ptp(points, axis=0))]
    angles = np.pi / ANGLES * np.arange(ANGLES)[:, None]
    around = np.cos(angles) * axes[0] + np.sin(angles) * axes[1]
    normal = np.cos(angles) * axes[1] - np.sin(angles) * axes[0]
    return np.vstack([around + TILT * normal + TILT**2 * axes[2], axes[2] + TILT * axes[0] + TILT**2 * axes[1]])
