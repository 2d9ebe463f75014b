"""Coupling interface between the macro model (``board``) and the meso model: matching nodes inside the board."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from reflowshock.fem.errors import CouplingError
from reflowshock.fem.mesh.mesh import MeshData, boundary_facets

MATCH = 1e-6  # of the shortest edge of the interface
MACRO, PATCH = "board", "board_patch"


def find_interface(mesh: MeshData) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Match the faces of the board patch (under the package) inside the board with the board's nodes.

    Args:
        mesh: Mesh of board and board patch.

    Returns:
        Node numbers of the macro side and of the meso side, ``(nc,)`` each; equal where the parts share nodes, empty
        where the mesh has only one of the two parts.

    Raises:
        CouplingError: A node of the patch has no partner in the board.
    """
    board, patch = mesh.cells[mesh.in_parts(MACRO.__eq__)], mesh.cells[mesh.in_parts(PATCH.__eq__)]
    if not len(board) or not len(patch):
        return np.empty(0, np.int32), np.empty(0, np.int32)
    facets = _inner_facets(mesh.points, board, patch)
    meso = np.unique(facets).astype(np.int32)
    edges = mesh.points[facets[:, [1, 2]]] - mesh.points[facets[:, [0, 0]]]
    tolerance = MATCH * float(np.linalg.norm(edges, axis=2).min())
    candidates = np.unique(boundary_facets(board)).astype(np.int32)
    distance, nearest = cKDTree(mesh.points[candidates]).query(mesh.points[meso])
    if distance.max() > tolerance:
        position = ", ".join(f"{value:.6g}" for value in mesh.points[meso[np.argmax(distance)]])
        raise CouplingError(
            f"{np.sum(distance > tolerance)} of {len(meso)} nodes of {PATCH} on the interface have no partner in"
            f" {MACRO}: the one at ({position}) m is {distance.max():.3e} m away, allowed are {tolerance:.3e} m"
        )
    return candidates[nearest], meso


def _inner_facets(points: NDArray[np.float64], board: NDArray[np.int32], patch: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the boundary facets of the patch that do not lie on the bounding box of board and patch, shape (nf, 4).

    Raises:
        CouplingError: No such facet exists, because board and patch do not touch.
    """
    both = points[np.unique(np.concatenate([board.ravel(), patch.ravel()]))]
    low, high = both.min(axis=0), both.max(axis=0)
    facets = boundary_facets(patch)
    corners = points[facets]
    off = MATCH * (high - low).min()
    outer = (np.abs(corners - low) < off).all(axis=1) | (np.abs(corners - high) < off).all(axis=1)
    inner = facets[~outer.any(axis=1)]
    if not len(inner):
        raise CouplingError(f"no face of {PATCH} lies inside the board: the coupling interface is empty")
    return inner
