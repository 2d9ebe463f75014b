"""Cells that no element can be made of: turned inside out, without volume, or too distorted."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import HEXAHEDRON
from reflowshock.fem.elements.tetrahedron import EDGES
from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import MeshData

# Three neighbours of each vertex, right-handed.
OF_HEXAHEDRON = np.array(
    [[a ^ 1, a ^ 2, a ^ 4] if bin(a).count("1") % 2 == 0 else [a ^ 2, a ^ 1, a ^ 4] for a in range(8)]
)
OF_TETRAHEDRON = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
MIDDLE = np.full((4, 4), -1)
MIDDLE[EDGES[:, 0], EDGES[:, 1]] = MIDDLE[EDGES[:, 1], EDGES[:, 0]] = 4 + np.arange(6)


def scaled_jacobians(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least scaled Jacobian of cells ``(ne, k, 3)``: ``(ne,)``, 1 for cubes and regular tetrahedra.

    At each vertex the volume that the three edges' tangents span, over the product of their lengths (Knupp, Verdict);
    0 where an edge has no length.
    """
    nodes = corners.shape[1]
    neighbours = OF_HEXAHEDRON if nodes == HEXAHEDRON.nodes else OF_TETRAHEDRON
    vertices = np.arange(len(neighbours))
    edges = corners[:, neighbours] - corners[:, vertices, None]
    if nodes == 10:  # the tangent at an end of a parabola
        middle = corners[:, MIDDLE[vertices[:, None], neighbours]]
        edges = 4.0 * middle - corners[:, neighbours] - 3.0 * corners[:, vertices, None]
    lengths = np.linalg.norm(edges, axis=3).prod(axis=2)
    regular = 1.0 if nodes == HEXAHEDRON.nodes else np.sqrt(2.0)
    spanned = regular * np.linalg.det(edges)
    return np.divide(spanned, lengths, out=np.zeros_like(spanned), where=lengths > 0.0).min(axis=1)


def check_quality(mesh: MeshData) -> None:
    """Check that every cell can carry an element.

    Raises:
        MeshError: With number, part and position of the worst cell, and what is wrong with it.
    """
    quality, limit = scaled_jacobians(mesh.points[mesh.cells]), mesh.shape.lowest_quality
    worst = int(np.argmin(quality))
    if quality[worst] >= limit:
        return
    fault = "too distorted"
    if quality[worst] < 1e-12:
        fault = "without volume" if quality[worst] > -1e-12 else "turned inside out"
    place = ", ".join(f"{value:.6g}" for value in mesh.points[mesh.cells[worst]].mean(axis=0))
    raise MeshError(
        f"element {worst} of part {mesh.part_names[mesh.part[worst]]} at ({place}) m is {fault}: scaled Jacobian"
        f" {quality[worst]:.3g}, allowed {limit:g} to 1; {np.sum(quality < limit)} of {len(quality)} elements are below"
    )
