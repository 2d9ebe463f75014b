"""Critical time step of the elements of a box, computed before anything is meshed."""

from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements, critical_steps, element_geometry, element_kind
from reflowshock.fem.elements.tetrahedron import EDGES
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.parameters import Material

CORNERS = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)], dtype=float)  # tensor order
NODES = {"hexahedron": 8, "tetrahedron": 4, "tetrahedron_quadratic": 10}


def box_element_step(element: str, formulation: str, material: Material, size: NDArray[np.float64]) -> float:
    """Return the smallest critical time step of central differences [s] of the elements into which a box is divided.

    Args:
        element: Element name of case files: ``hexahedron`` (one element), ``tetrahedron`` or ``tetrahedron_quadratic``.
            The six tetrahedra share one diagonal of the box; a mesh may use another one.
        formulation: Formulation of hexahedra, ``incompatible_modes`` or ``one_point``; not used for tetrahedra.
        material: Elastic material and density, with axes along x, y and z.
        size: Edge lengths of the box, shape (3,) [m].
    """
    points, cells = (CORNERS, np.arange(8)[None]) if element == "hexahedron" else diagonal_tetrahedra()
    if element == "tetrahedron_quadratic":
        points, cells = with_middle_nodes(points, cells)
    elements = Elements(
        points=points * size,
        cells=cells.astype(np.int32),
        material=np.zeros(len(cells), np.int32),
        elasticity=elasticity_matrix(material)[None],
        density=np.full(len(cells), material.density),
        kind=element_kind(NODES[element], formulation),
    )
    geometry = element_geometry(elements.points, elements.cells)
    return float(critical_steps(elements, geometry.nodal_volume).min())


def diagonal_tetrahedra() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the unit cube cut into six tetrahedra that share a diagonal (Kuhn).

    Returns:
        Corners of the cube in tensor order, shape (8, 3), and corners of each tetrahedron, shape (6, 4), with positive
        volume.
    """
    cells = np.array([[0, 1 << a, 1 << a | 1 << b, 7] for a, b, _ in permutations(range(3))])
    edges = CORNERS[cells[:, 1:]] - CORNERS[cells[:, :1]]
    inside_out = np.linalg.det(edges) < 0.0
    cells[inside_out] = cells[inside_out][:, [0, 2, 1, 3]]
    return CORNERS, cells


def with_middle_nodes(
    points: NDArray[np.float64], cells: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return 10-node tetrahedra, with nodes added at the edge midpoints of 4-node tetrahedra.

    Neighbours do not share the new nodes, which does not matter for critical steps of single elements.

    Args:
        points: Vertices, shape (n, 3) [m].
        cells: Vertices of each tetrahedron, shape (ne, 4).

    Returns:
        Vertices followed by midpoints, shape (n + 6 ne, 3) [m]; four vertices and six midpoints of each cell, (ne, 10).
    """
    middles = points[cells[:, EDGES]].mean(axis=2)
    numbers = len(points) + np.arange(middles.shape[0] * middles.shape[1]).reshape(middles.shape[:2])
    return np.concatenate([points, middles.reshape(-1, 3)]), np.concatenate([cells, numbers], axis=1)
