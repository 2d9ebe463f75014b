"""Eight-node hexahedra in VTK node order: volume, scaled Jacobian, characteristic length, and mesh smoothing.

Smoothing minimises the sum of (J0 - J)^2 over all corners whose scaled Jacobian J is below a target J0, by gradient
descent. Interior nodes move freely, surface nodes along the surface.
"""

from dataclasses import dataclass

import numpy as np

TARGET_JACOBIAN = 0.35  # corners with a smaller scaled Jacobian contribute to the objective
ACTIVE_JACOBIAN = 0.55  # corners with a smaller scaled Jacobian are evaluated in a round
ROUNDS, STEPS = 4, 15
STRIDE = 0.5  # first step of the descent, relative to the gradient times the square of a node's shortest edge
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
# The three neighbours of each corner along edges, ordered so that a valid corner has a positive triple product.
CORNER_NEIGHBOURS = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])
GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])


def volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return the volume of each trilinear hexahedron (c, 8), shape (c,) [m^3]; the 2 x 2 x 2 Gauss rule is exact.

    Args:
        points: Node coordinates, shape (n, 3) [m].
        cells: Nodes of the hexahedra, shape (c, 8): lower face counter-clockwise, then upper face (VTK's order).
    """
    total = np.zeros(len(cells))
    for location in np.array(np.meshgrid(GAUSS, GAUSS, GAUSS)).reshape(3, -1).T:
        factors = 1.0 + CORNERS * location
        derivatives = [0.125 * CORNERS[:, k] * factors[:, (k + 1) % 3] * factors[:, (k + 2) % 3] for k in range(3)]
        jacobian = np.einsum("ka,cai->cki", np.array(derivatives), points[cells])
        total += np.linalg.det(jacobian)
    return total


def scaled_jacobian(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return the scaled Jacobian of each hexahedron (c, 8), shape (c,): 1 for a box, <= 0 if inverted.

    It is the smallest triple product of the unit edge vectors over the eight corners.

    Args:
        points: Node coordinates, shape (n, 3) [m].
        cells: Nodes of the hexahedra, shape (c, 8): lower face counter-clockwise, then upper face (VTK's order).
    """
    corners = points[cells]
    edges = corners[:, CORNER_NEIGHBOURS] - corners[:, :, None, :]
    edges /= np.linalg.norm(edges, axis=-1, keepdims=True)
    return np.linalg.det(edges).min(axis=1)


def shortest_lengths(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return the volume over the largest face of each hexahedron (c, 8), shape (c,) [m].

    This length over the wave speed estimates the critical time step.

    Args:
        points: Node coordinates, shape (n, 3) [m].
        cells: Nodes of the hexahedra, shape (c, 8): lower face counter-clockwise, then upper face (VTK's order).
    """
    faces = cells[:, FACES].reshape(-1, 4)
    return volumes(points, cells) / quad_areas(points, faces).reshape(-1, len(FACES)).max(axis=1)


def quad_areas(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Return the area of each plane quadrilateral (q, 4), half the cross product of its diagonals, (q,) [m^2].

    Args:
        points: Node coordinates, shape (n, 3) [m].
        quads: Nodes of the quadrilaterals in order around each, shape (q, 4).
    """
    corners = points[quads]
    return 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=-1)


def boundary_quads(cells: np.ndarray) -> np.ndarray:
    """Return the faces that belong to one hexahedron only, as node numbers, shape (f, 4).

    Nodes run counter-clockwise seen from outside.

    Args:
        cells: Nodes of the hexahedra, shape (c, 8): lower face counter-clockwise, then upper face (VTK's order).
    """
    faces = cells[:, FACES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


@dataclass(frozen=True, slots=True)
class Freedom:
    """Constraints on the motion of nodes during smoothing.

    Attributes:
        free: Whether each node may move, shape (n,).
        normals: Unit vectors along which nodes may not move, zero for interior nodes, shape (n, 3).
    """

    free: np.ndarray
    normals: np.ndarray

    def admitted(self, directions: np.ndarray) -> np.ndarray:
        """Return the admissible part of directions of motion, shape (n, 3)."""
        along = np.einsum("ni,ni->n", directions, self.normals)
        return np.where(self.free[:, None], directions - along[:, None] * self.normals, 0.0)


def relax_hexahedra(points: np.ndarray, cells: np.ndarray, freedom: Freedom) -> np.ndarray:
    """Smooth a mesh so that corners with a small scaled Jacobian get a larger one.

    Nodes descend along the gradient of an objective that penalises small Jacobians, with a stride in proportion to
    their own edges; a step that does not reduce the objective is rejected.

    Args:
        points: Node coordinates, shape (n, 3) [m].
        cells: Nodes of the hexahedra, shape (c, 8).
        freedom: Whether each node may move, and the direction in which it may not.

    Returns:
        Smoothed node coordinates, shape (n, 3) [m].
    """
    corners = np.concatenate([cells[:, [k, *CORNER_NEIGHBOURS[k]]] for k in range(8)])
    corners = corners[freedom.free[corners].any(axis=1)]
    scale = _squared_shortest_edges(points, corners)
    for _ in range(ROUNDS):
        points = _round(points, corners[_jacobian(points, corners) < ACTIVE_JACOBIAN], scale, freedom)
    return points


def _round(points: np.ndarray, corners: np.ndarray, scale: np.ndarray, freedom: Freedom) -> np.ndarray:
    """Take descent steps for the active corners, each node scaled by its squared shortest edge (n,) [m^2]."""
    stride = STRIDE
    total, gradient = _objective(points, corners)
    for _ in range(STEPS):
        if total == 0.0:
            break
        trial = points - stride * scale[:, None] * freedom.admitted(gradient)
        after, next_gradient = _objective(trial, corners)
        if after < total:
            points, total, gradient, stride = trial, after, next_gradient, 1.3 * stride
        else:
            stride *= 0.3
    return points


def _units(points: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors along the edges of corners (k, 4), (k, 3, 3), and their lengths, (k, 3, 1) [m]."""
    edges = points[corners[:, 1:]] - points[corners[:, :1]]
    lengths = np.linalg.norm(edges, axis=2, keepdims=True)
    return edges / lengths, lengths


def _jacobian(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    return np.linalg.det(_units(points, corners)[0])


def _objective(points: np.ndarray, corners: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the objective over corners (k, 4), each a node and its three neighbours, and its gradient, (n, 3)."""
    units, lengths = _units(points, corners)
    normals = np.cross(np.roll(units, -1, axis=1), np.roll(units, -2, axis=1))
    jacobian = np.einsum("ki,ki->k", units[:, 0], normals[:, 0])
    bad = jacobian < TARGET_JACOBIAN
    shortfall = (TARGET_JACOBIAN - jacobian[bad])[:, None, None]
    pull = normals[bad] - units[bad] * jacobian[bad][:, None, None]
    pull *= -2.0 * shortfall / lengths[bad]
    at_nodes = np.concatenate([-pull.sum(axis=1, keepdims=True), pull], axis=1).reshape(-1, 3)
    nodes = corners[bad].ravel()
    gradient = np.stack([np.bincount(nodes, at_nodes[:, axis], len(points)) for axis in range(3)], axis=1)
    return float((shortfall**2).sum()), gradient


def _squared_shortest_edges(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the square of the shortest edge at each node, shape (n,) [m^2]."""
    shortest = np.full(len(points), np.inf)
    np.minimum.at(shortest, corners[:, 0], _units(points, corners)[1].min(axis=(1, 2)))
    return np.where(np.isfinite(shortest), shortest, 0.0) ** 2
