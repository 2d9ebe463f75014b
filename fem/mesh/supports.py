"""Supports in the frame of the drop table: displacement components that are fixed at zero."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.mesh.mesh import MeshData

# Facet set -> components held: bolted mounting holes; symmetry planes normal to x and y.
HELD = {"mounting_holes": (0, 1, 2), "symmetry_x": (0,), "symmetry_y": (1,)}


SYMMETRY = {name: components for name, components in HELD.items() if name != "mounting_holes"}


def held_components(mesh: MeshData, rules: Mapping[str, Sequence[int]] = HELD) -> NDArray[np.bool_]:
    """Return whether each displacement component of each node is fixed, shape (n, 3).

    Args:
        mesh: The mesh, n nodes.
        rules: Facet set -> its fixed components (0, 1, 2 for x, y, z); sets that the mesh lacks fix nothing. By default
            mounting holes and symmetry planes x = 0 and y = 0.
    """
    held = np.zeros((len(mesh.points), 3), dtype=bool)
    for name, components in rules.items():
        held[np.ix_(mesh.facet_nodes(name), np.array(components))] = True
    return held
