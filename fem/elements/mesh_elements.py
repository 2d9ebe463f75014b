"""Elements of a mesh with the materials of its parts."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements, element_kind
from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.parameters import Material


def elements_of(
    points: NDArray[np.float64],
    cells: NDArray[np.int32],
    part: NDArray[np.int32],
    materials: Sequence[Material],
    formulation: str = HEXAHEDRON.name,
) -> Elements:
    """Return the elements of cells with the materials of their parts.

    Args:
        points: Nodes, shape (n, 3) [m].
        cells: Nodes of each cell, shape (ne, k), k = 4, 8 or 10; tensor order for hexahedra.
        part: Index of each cell into ``materials``, shape (ne,).
        materials: Material of each part: elasticity and density.
        formulation: Formulation of hexahedra, ``incompatible_modes`` or ``one_point``; not used for tetrahedra.

    Returns:
        Nodes, cells, elasticity and density of each material, material of each cell, and kind of element.
    """
    return Elements(
        points=points,
        cells=cells,
        material=part,
        elasticity=np.array([elasticity_matrix(material) for material in materials]),
        density=np.array([material.density for material in materials])[part],
        kind=element_kind(cells.shape[1], formulation),
    )
