"""Values at a node from the mean values of the elements around it: a linear field fitted to them.

The means of elements are their best known strains and stresses (superconvergent patch recovery: Zienkiewicz & Zhu,
IJNME 33, 1992). A linear field through two rings of elements carries them to a surface, which bending needs. Where one
layer of elements is all there is, no gradient across it can be known, and the value is that of the layer's middle.
"""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.mesh.mesh import MeshData

NEARNESS = 2.0  # in the weight exp(-2 d^2) of an element, d its distance in sizes of the nearest ones
SMALLEST = 1e-6  # of the largest singular value: below it a direction is not covered


def patch(mesh: MeshData, node: int) -> NDArray[np.int64]:
    """Return the elements of one part that have a node, nearest ones first, and those that touch them.

    Of several parts that meet at the node it is the lowest.
    """
    first = np.flatnonzero((mesh.cells == node).any(axis=1))
    heights = {part: mesh.points[mesh.cells[first[mesh.part[first] == part]], 2].mean() for part in mesh.part[first]}
    same = mesh.part == min(heights, key=lambda part: heights[part])
    first = first[same[first]]
    touching = np.isin(mesh.cells, mesh.cells[first]).any(axis=1) & same
    touching[first] = False
    return np.concatenate([first, np.flatnonzero(touching)])


def fit(centres: NDArray[np.float64], nearest: int, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weights ``(m,)`` of element means in the value at a point.

    Args:
        centres: ``(m, 3)`` [m] of the elements.
        nearest: How many of them, the first ones, touch the point.
        point: ``(3,)`` [m].

    Returns:
        They add up to one; together with ``centres`` they give the place that the value belongs to, ``point`` itself
        where the elements lie in more than one layer across each direction.
    """
    size = 2.0 * np.abs(centres[:nearest] - point).max(axis=0)
    scaled = (centres - point) / np.where(size > 0.0, size, 1.0)
    root = np.exp(-0.5 * NEARNESS * np.sum(scaled**2, axis=1))
    middle = root**2 @ scaled / np.sum(root**2)
    rows = root[:, None] * np.column_stack([np.ones(len(scaled)), scaled - middle])
    at_point = np.concatenate([[1.0], -middle])
    return at_point @ np.linalg.pinv(rows, rcond=SMALLEST) * root
