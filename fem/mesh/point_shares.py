"""Distribution of a force or mass at a point to the nodes of the element around it."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import HEXAHEDRON
from reflowshock.fem.errors import LoadError
from reflowshock.fem.kernels.hexahedron import SIDES, shape_derivatives
from reflowshock.fem.mesh.mesh import MeshData

ROUNDING = 1e-6  # of an element: a point on its face is inside
NEWTON_STEPS = 15
FARTHEST = 1.5  # in reference coordinates: iterates are clipped there, because points outside only need finite values


def point_shares(
    mesh: MeshData, key: str, position: tuple[float, float, float]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Distribute a unit force at a point to the vertices of the element around it.

    The shares are the shape functions of the vertices. They add up to one and reproduce the position, so that the nodal
    forces have the resultant and the moment of the force.

    Args:
        mesh: The whole mesh.
        key: Key of the position in the case file, for errors.
        position: Coordinates of the point [m].

    Returns:
        Nodes, shape (k,), and their shares, shape (k,).

    Raises:
        LoadError: The point lies outside the mesh.
    """
    at = np.array(position)
    corners = mesh.points[mesh.cells[:, : _vertices(mesh)]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    margin = ROUNDING * (high - low)
    near = np.flatnonzero(((low - margin <= at) & (at <= high + margin)).all(axis=1))
    shares = (_trilinear if mesh.shape is HEXAHEDRON else _barycentric)(corners[near], at)
    least = shares.min(axis=1)  # negative outside
    if not (least >= -ROUNDING).any():
        distance = np.linalg.norm(mesh.points - at, axis=1)
        node = int(np.argmin(distance))
        here, there = (", ".join(f"{value:.6g}" for value in point) for point in (at, mesh.points[node]))
        raise LoadError(
            f"{key} = ({here}) m lies outside the mesh: the nearest node is ({there}) m, {distance[node]:.3g} m away"
        )
    best = int(np.argmax(least))
    return mesh.cells[near[best], : corners.shape[1]].astype(np.int64), shares[best]


def _vertices(mesh: MeshData) -> int:
    """Return the number of vertices of a cell, which are its first nodes."""
    return 8 if mesh.shape is HEXAHEDRON else 4


def _barycentric(corners: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the barycentric coordinates of a point (3,) [m] in tetrahedra (m, 4, 3) [m], shape (m, 4)."""
    edges = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2)
    others = np.linalg.solve(edges, (at - corners[:, 0])[:, :, None])[:, :, 0]
    return np.column_stack([1.0 - others.sum(axis=1), others])


def _trilinear(corners: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shape functions of hexahedra (m, 8, 3) [m] at a point (3,) [m] by Newton iteration, shape (m, 8)."""
    xi = np.zeros((len(corners), 3))
    for _ in range(NEWTON_STEPS):
        residual = at - np.einsum("ma,mai->mi", shape_functions(xi), corners)
        jacobian = np.einsum("mai,mad->mid", corners, shape_derivatives(xi))
        xi = np.clip(xi + np.linalg.solve(jacobian, residual[:, :, None])[:, :, 0], -FARTHEST, FARTHEST)
    return shape_functions(xi)


def shape_functions(xi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the trilinear shape functions of the reference cube [-1, 1]^3, shape (m, 8), nodes in tensor order.

    Args:
        xi: Points in the cube, shape (m, 3).
    """
    return 0.125 * np.prod(1.0 + xi[:, None, :] * SIDES, axis=2)
