"""Displacements of the package relative to the board: raised flat, lifted as prescribed, or computed.

The board is meshed flat, as drawn, and so are its pads: what counts is where the package is, seen from the board below
it, u_package(x) - u_board(top face, same x and y).
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.meshing.board.pads import lift
from reflowshock.meshing.board.parameters import Package, Warpage
from reflowshock.meshing.core.structured_face import MERGE, StructuredFace

Displacement = Callable[[np.ndarray], np.ndarray]  # reference places (n, 3) [m] -> displacements (n, 3) [m]


class DisplacementError(ValueError):
    """Nodes that a computed displacement does not know."""


def prescribed(package: Package, warpage: Warpage) -> Displacement:
    """Return the displacement of a package that is lifted."""

    def displacement(points: np.ndarray) -> np.ndarray:
        height = lift(package, warpage, points[:, 0], points[:, 1])
        return np.column_stack([np.zeros_like(points[:, :2]), height])

    return displacement


def raised(height: float) -> Displacement:
    """Return the displacement of a flat package that stands higher than drawn [m]."""
    return lambda points: np.broadcast_to([0.0, 0.0, height], points.shape)


def read_computed(path: Path) -> Displacement:
    """Read the displacement that a reflow left in its ``structure.npz``; errors as ``computed``."""
    with np.load(path) as arrays:
        return computed(arrays["points"], arrays["displacement"], arrays["package"])


def computed(points: np.ndarray, displacement: np.ndarray, is_package: np.ndarray) -> Displacement:
    """Return the displacement of the package relative to the board's top face, by the nodes of both.

    Args:
        points: (n, 3) where the nodes of package and board were [m].
        displacement: (n, 3) of them [m].
        is_package: (n,) which of them are the package's.

    Raises:
        NotStructuredError: the board's top face under the package is no grid.
    """
    package, moved = points[is_package], displacement[is_package]
    top = _board_top(points[~is_package], displacement[~is_package], package)
    relative = moved - top(package[:, 0], package[:, 1])
    tree = cKDTree(package)

    def at(places: np.ndarray) -> np.ndarray:
        distance, node = tree.query(places)
        if (worst := int(distance.argmax())) >= 0 and distance[worst] > MERGE:
            place = ", ".join(f"{value:.6g}" for value in places[worst])
            raise DisplacementError(
                f"no displacement is known at ({place}) m: the nearest is {distance[worst]:.3g} m off"
            )
        return relative[node]

    return at


def _board_top(points: np.ndarray, displacement: np.ndarray, package: np.ndarray) -> StructuredFace:
    """Return the displacement of the board's top face below the package."""
    low, high = package[:, :2].min(axis=0) - MERGE, package[:, :2].max(axis=0) + MERGE
    below = np.all((points[:, :2] >= low) & (points[:, :2] <= high), axis=1)
    on_top = below & (points[:, 2] >= points[below, 2].max() - MERGE)
    return StructuredFace.of_nodes(points[on_top], displacement[on_top])
