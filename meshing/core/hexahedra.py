"""Volumes, quality and characteristic length of 8-node hexahedra (VTK node order)."""

import numpy as np

FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
# The three neighbours of each corner along edges, ordered so that a valid corner has a positive triple product.
CORNER_NEIGHBOURS = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])
GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])


def volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Volume of each trilinear hexahedron (c,) [m^3], by the 2 x 2 x 2 Gauss rule, which is exact."""
    total = np.zeros(len(cells))
    for location in np.array(np.meshgrid(GAUSS, GAUSS, GAUSS)).reshape(3, -1).T:
        factors = 1.0 + CORNERS * location
        derivatives = [0.125 * CORNERS[:, k] * factors[:, (k + 1) % 3] * factors[:, (k + 2) % 3] for k in range(3)]
        jacobian = np.einsum("ka,cai->cki", np.array(derivatives), points[cells])
        total += np.linalg.det(jacobian)
    return total


def scaled_jacobian(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Smallest triple product of unit edge vectors over the eight corners (c,): 1 for a box, <= 0 inside out."""
    corners = points[cells]
    edges = corners[:, CORNER_NEIGHBOURS] - corners[:, :, None, :]
    edges /= np.linalg.norm(edges, axis=-1, keepdims=True)
    return np.linalg.det(edges).min(axis=1)


def shortest_lengths(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Volume over the largest face (c,) [m]: the length that, over the wave speed, estimates the critical time step."""
    faces = cells[:, FACES].reshape(-1, 4)
    return volumes(points, cells) / quad_areas(points, faces).reshape(-1, len(FACES)).max(axis=1)


def quad_areas(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Area of each flat quadrilateral (q,) [m^2]: half the cross product of its diagonals."""
    corners = points[quads]
    return 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=-1)


def boundary_quads(cells: np.ndarray) -> np.ndarray:
    """Return the faces (f, 4) that belong to one cell only, seen from outside counter-clockwise."""
    faces = cells[:, FACES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]
