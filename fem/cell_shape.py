"""Shapes of cells: order of nodes, faces, names in files and in DOLFINx. A mesh holds cells of one shape."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Gmsh and VTK number a hexahedron around its faces; here, as in DOLFINx, bit d of a local index is the side in
# direction d.
TENSOR_ORDER = np.array([0, 1, 3, 2, 4, 5, 7, 6])
FACES = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 3, 6, 7], [0, 2, 4, 6], [1, 3, 5, 7]])
TRIANGLES = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
MIDDLES = np.array([[6, 4, 5], [8, 4, 7], [9, 5, 7], [9, 6, 8]])  # on the edges ab, bc, ca of each triangle abc


@dataclass(frozen=True, slots=True, eq=False)
class CellShape:
    """A shape of cells.

    Attributes:
        name: In meshio; its nodes are in VTK's order there.
        facet: Shape of the facets in meshio: cyclic quadrilaterals, triangles, triangles with nodes on their edges.
        order: ``(k,)`` position of our nodes in VTK's order; ours is that of DOLFINx.
        faces: ``(f, m)`` local nodes of the faces; of quadrilaterals in tensor order, else as in ``facet``.
        cell: In DOLFINx.
        degree: Polynomial degree of the geometry.
        lowest_quality: Least scaled Jacobian that is taken.
    """

    name: str
    facet: str
    order: NDArray[np.integer]
    faces: NDArray[np.integer]
    cell: str
    degree: int
    lowest_quality: float

    @property
    def nodes(self) -> int:
        """Return the number of nodes of a cell."""
        return len(self.order)


HEXAHEDRON = CellShape("hexahedron", "quad", TENSOR_ORDER, FACES, "hexahedron", 1, lowest_quality=0.02)
# Flat tetrahedra fill thin layers: a layer of aspect 25 needs 0.02 and less.
TETRAHEDRON = CellShape("tetra", "triangle", np.arange(4), TRIANGLES, "tetrahedron", 1, lowest_quality=1e-3)
TETRAHEDRON_QUADRATIC = CellShape(
    "tetra10",
    "triangle6",
    np.array([0, 1, 2, 3, 9, 8, 5, 7, 6, 4]),
    np.hstack([TRIANGLES, MIDDLES]),
    "tetrahedron",
    2,
    lowest_quality=1e-3,
)
SHAPES = {shape.nodes: shape for shape in (HEXAHEDRON, TETRAHEDRON, TETRAHEDRON_QUADRATIC)}


def shape_of(cells: NDArray[np.integer]) -> CellShape:
    """Return the shape of cells (tetrahedron or hexahedron), which follows from their number of nodes.

    Args:
        cells: Nodes of each cell, shape (ne, k), k = 4, 8 or 10.

    Raises:
        KeyError: No shape has k nodes.
    """
    return SHAPES[cells.shape[1]]
