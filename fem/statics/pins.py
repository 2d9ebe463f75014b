"""Supports that hold a body's remaining rigid motions and nothing else: as many components as there are motions."""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

RANK = 1e-9  # of the largest singular value: below it a rigid motion is not held


def pins(
    points: NDArray[np.float64], held: NDArray[np.bool_], usable: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Choose components whose hold is statically determinate: a load in balance has no reaction there.

    Of the rigid motions that leave all held components at rest, the pivots of a QR factorisation are the components
    that tell them apart best.

    Args:
        points: ``(n, 3)`` [m].
        held: ``(n, 3)`` components that are held already.
        usable: ``(n,)`` nodes that may be pinned.

    Returns:
        Nodes and components, one for each rigid motion that is left.
    """
    motions = rigid_motions(points)
    _, values, right = np.linalg.svd(motions[held], full_matrices=True)
    rank = int(np.sum(values > RANK * len(points) ** 0.5)) if held.any() else 0
    left = np.where((usable[:, None] & ~held)[:, :, None], motions, 0.0).reshape(-1, 6) @ right[rank:].T
    _, _, pivots = scipy.linalg.qr(left.T, mode="economic", pivoting=True)
    chosen = np.sort(pivots[: 6 - rank])
    return chosen // 3, chosen % 3


def rigid_motions(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return translations along and rotations about x, y, z ``(n, 3, 6)``; lengths in units of the body's size."""
    scaled = (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()
    motions = np.zeros((len(points), 3, 6))
    for axis in range(3):
        motions[:, axis, axis] = 1.0
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], scaled)
    return motions
