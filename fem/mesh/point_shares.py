"""Shares of an element's nodes in what acts at a point inside it."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import HEXAHEDRON
from reflowshock.fem.errors import LoadError
from reflowshock.fem.kernels.hexahedron import SIDES, shape_derivatives
from reflowshock.fem.mesh.mesh import MeshData

ROUNDING = 1e-6  # of an element: a point on its face is inside
NEWTON_STEPS = 15
FARTHEST = 1.5  # in reference coordinates: beyond it an element needs no answer, only a finite one


def point_shares(
    mesh: MeshData, key: str, place: tuple[float, float, float]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the nodes ``(k,)`` that share what acts at a place [m], and their shares ``(k,)``.

    They are the shape functions of the vertices of the element there: they add up to one, and the mean of the vertices
    with them as weights is the place itself. Nodal forces in these shares thus have the resultant and the moment of the
    force that they share.

    Args:
        mesh: The whole mesh.
        key: Of the place, for errors.
        place: [m].

    Raises:
        LoadError: No element is there.
    """
    at = np.array(place)
    corners = mesh.points[mesh.cells[:, : vertices(mesh)]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    margin = ROUNDING * (high - low)
    near = np.flatnonzero(((low - margin <= at) & (at <= high + margin)).all(axis=1))
    shares = (trilinear if mesh.shape is HEXAHEDRON else barycentric)(corners[near], at)
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


def vertices(mesh: MeshData) -> int:
    """Return the number of vertices of a cell, which are its first nodes."""
    return 8 if mesh.shape is HEXAHEDRON else 4


def barycentric(corners: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the barycentric coordinates ``(m, 4)`` of a place ``(3,)`` [m] in tetrahedra ``(m, 4, 3)``."""
    edges = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2)
    others = np.linalg.solve(edges, (at - corners[:, 0])[:, :, None])[:, :, 0]
    return np.column_stack([1.0 - others.sum(axis=1), others])


def trilinear(corners: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the eight shape functions ``(m, 8)`` of hexahedra ``(m, 8, 3)`` at a place ``(3,)`` [m], by Newton."""
    xi = np.zeros((len(corners), 3))
    for _ in range(NEWTON_STEPS):
        residual = at - np.einsum("ma,mai->mi", shape_functions(xi), corners)
        jacobian = np.einsum("mai,mad->mid", corners, shape_derivatives(xi))
        xi = np.clip(xi + np.linalg.solve(jacobian, residual[:, :, None])[:, :, 0], -FARTHEST, FARTHEST)
    return shape_functions(xi)


def shape_functions(xi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return N_a at points ``xi (m, 3)`` of the reference cube [-1, 1]^3: ``(m, 8)``."""
    return 0.125 * np.prod(1.0 + xi[:, None, :] * SIDES, axis=2)
