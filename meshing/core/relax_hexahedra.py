"""Hexahedra made better shaped: nodes inside move freely, those on the surface along it."""

from dataclasses import dataclass

import numpy as np

from reflowshock.meshing.core.hexahedra import CORNER_NEIGHBOURS

WANTED = 0.35  # scaled Jacobian up to which corners pull at their nodes
WATCHED = 0.55  # corners up to this one take part in a round
ROUNDS, STEPS = 4, 15
STRIDE = 0.5  # of the square of the shortest edge at a node, times the gradient


@dataclass(frozen=True, slots=True)
class Freedom:
    """What nodes may do.

    Attributes:
        free: (n,) whether a node moves.
        normals: (n, 3) unit vectors along which it does not; zero for nodes inside.
    """

    free: np.ndarray
    normals: np.ndarray

    def admitted(self, directions: np.ndarray) -> np.ndarray:
        """Return what is left of directions (n, 3)."""
        along = np.einsum("ni,ni->n", directions, self.normals)
        return np.where(self.free[:, None], directions - along[:, None] * self.normals, 0.0)


def relax_hexahedra(points: np.ndarray, cells: np.ndarray, freedom: Freedom) -> np.ndarray:
    """Move nodes so that the corners with a small scaled Jacobian get a larger one.

    Descends along the gradient of sum (wanted - J)^2 over the corners whose scaled Jacobian J is below the wanted one,
    each node by a stride in the scale of its own edges; a step after which the sum is not smaller is taken back.

    Args:
        points: (n, 3) [m].
        cells: (c, 8).
        freedom: of the nodes.

    Returns:
        Points (n, 3) [m].
    """
    corners = np.concatenate([cells[:, [k, *CORNER_NEIGHBOURS[k]]] for k in range(8)])
    corners = corners[freedom.free[corners].any(axis=1)]
    reach = _reach(points, corners)
    for _ in range(ROUNDS):
        points = _round(points, corners[_jacobian(points, corners) < WATCHED], reach, freedom)
    return points


def _round(points: np.ndarray, corners: np.ndarray, reach: np.ndarray, freedom: Freedom) -> np.ndarray:
    """Take some steps for the corners that are watched."""
    stride = STRIDE
    total, gradient = _badness(points, corners)
    for _ in range(STEPS):
        if total == 0.0:
            break
        trial = points - stride * reach[:, None] * freedom.admitted(gradient)
        after, next_gradient = _badness(trial, corners)
        if after < total:
            points, total, gradient, stride = trial, after, next_gradient, 1.3 * stride
        else:
            stride *= 0.3
    return points


def _units(points: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (k, 3, 3) along the edges of corners (k, 4), and their lengths (k, 3, 1) [m]."""
    edges = points[corners[:, 1:]] - points[corners[:, :1]]
    lengths = np.linalg.norm(edges, axis=2, keepdims=True)
    return edges / lengths, lengths


def _jacobian(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    return np.linalg.det(_units(points, corners)[0])


def _badness(points: np.ndarray, corners: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the sum over corners (k, 4), each with its three neighbours, and its gradient (n, 3)."""
    units, lengths = _units(points, corners)
    normals = np.cross(np.roll(units, -1, axis=1), np.roll(units, -2, axis=1))
    jacobian = np.einsum("ki,ki->k", units[:, 0], normals[:, 0])
    bad = jacobian < WANTED
    miss = (WANTED - jacobian[bad])[:, None, None]
    pull = normals[bad] - units[bad] * jacobian[bad][:, None, None]
    pull *= -2.0 * miss / lengths[bad]
    at_nodes = np.concatenate([-pull.sum(axis=1, keepdims=True), pull], axis=1).reshape(-1, 3)
    nodes = corners[bad].ravel()
    gradient = np.stack([np.bincount(nodes, at_nodes[:, axis], len(points)) for axis in range(3)], axis=1)
    return float((miss**2).sum()), gradient


def _reach(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Square of the shortest edge at each node (n,) [m^2]."""
    shortest = np.full(len(points), np.inf)
    np.minimum.at(shortest, corners[:, 0], _units(points, corners)[1].min(axis=(1, 2)))
    return np.where(np.isfinite(shortest), shortest, 0.0) ** 2
