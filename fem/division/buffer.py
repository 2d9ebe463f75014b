"""Layers of cells around some nodes: between what is fine and an interface at which velocities are held."""

import numpy as np
from numpy.typing import NDArray


def touching(cells: NDArray[np.int32], nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which cells ``(ne,)`` have one of the nodes ``(n,)``."""
    return nodes[cells].any(axis=1)


def nodes_of(cells: NDArray[np.int32], chosen: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Return which of ``count`` nodes belong to one of the chosen cells ``(ne,)``."""
    found = np.zeros(count, dtype=bool)
    found[cells[chosen]] = True
    return found


def grown(
    cells: NDArray[np.int32], seeds: NDArray[np.bool_], through: NDArray[np.bool_], layers: int
) -> NDArray[np.bool_]:
    """Return the cells ``(ne,)`` of some layers around seeds, each of which touches a node of the layer before.

    Args:
        cells: ``(ne, k)`` nodes.
        seeds: ``(n,)`` nodes that the first layer touches.
        through: ``(ne,)`` cells that a layer may have.
        layers: Number of layers.
    """
    taken = np.zeros(len(cells), dtype=bool)
    for _ in range(layers):
        taken |= through & touching(cells, seeds)
        seeds = seeds | nodes_of(cells, taken, len(seeds))
    return taken
