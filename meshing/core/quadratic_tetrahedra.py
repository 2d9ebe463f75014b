"""Ten-node tetrahedra of a free-form body for other codes: curved along its surface, straight inside."""

from dataclasses import dataclass
from itertools import product
from math import factorial
from pathlib import Path

import gmsh
import numpy as np

from reflowshock.meshing.core.gmsh_session import gmsh_model, name_groups, write_msh
from reflowshock.meshing.core.split_tetrahedra import EDGES, SplitTetrahedra

KIND, FACE = 11, 9  # Gmsh's ten-node tetrahedron and six-node triangle
ORDER = np.array([0, 3, 1, 2, 5, 4])  # positions of Gmsh's edges 01 12 20 03 23 13 in ``EDGES``, 01 02 03 12 13 23
# Exact for cubics (Keast 1986, five points): barycentric coordinates and weights of the unit tetrahedron.
STATIONS = np.vstack([np.full(4, 0.25), np.full((4, 4), 1.0 / 6.0) + np.eye(4) / 3.0])
WEIGHTS = np.array([-0.8, 0.45, 0.45, 0.45, 0.45]) / 6.0
CUBIC = np.array([powers for powers in product(range(4), repeat=4) if sum(powers) == 3])  # exponents (Bernstein basis)
LEAST_JACOBIAN = 0.05  # ratio of the Jacobians of the curved and the straight tetrahedron


@dataclass(frozen=True, slots=True)
class QuadraticTetrahedra:
    """Mesh of ten-node tetrahedra in Gmsh's node order.

    Attributes:
        points: Node coordinates, shape (n, 3) [m].
        cells: Nodes of the tetrahedra, shape (c, 10).
        faces: Facet set name -> nodes of the six-node triangles, shape (f, 6).
    """

    points: np.ndarray
    cells: np.ndarray
    faces: dict[str, np.ndarray]


def quadratic_tetrahedra(
    split: SplitTetrahedra, points: np.ndarray, tetrahedra: np.ndarray, faces: dict[str, np.ndarray]
) -> QuadraticTetrahedra:
    """Build ten-node tetrahedra whose surface edges are curved like the split hexahedra.

    Args:
        split: Hexahedra into which the tetrahedra were split, with lookups of the midpoints of edges and faces.
        points: Smoothed node coordinates of these hexahedra, shape (n, 3) [m]; give the midpoints of surface edges.
        tetrahedra: Vertices of the tetrahedra, shape (c, 4).
        faces: Facet set name -> vertices of surface triangles, shape (f, 3).

    Returns:
        Nodes, ten-node tetrahedra in Gmsh's order, and six-node triangles of each facet set.
    """
    count = split.vertices + len(split.edges)
    cells = np.hstack([tetrahedra, split.middles(tetrahedra[:, EDGES])[:, ORDER]])
    curved = {name: _with_middles(split, triangles) for name, triangles in faces.items()}
    placed = points[:count].copy()
    inside = np.setdiff1d(cells[:, 4:], np.concatenate([face[:, 3:].ravel() for face in curved.values()]))
    ends = np.empty((count, 2), dtype=np.int64)
    ends[cells[:, 4:]] = tetrahedra[:, EDGES[ORDER]]
    placed[inside] = points[ends[inside]].mean(axis=1)
    return QuadraticTetrahedra(_unfold(placed, cells, ends), cells, curved)


def tetrahedra_quality(tetrahedra: QuadraticTetrahedra, volume: float) -> dict[str, float]:
    """Return measures of the quality of tetrahedra.

    Args:
        tetrahedra: Ten-node tetrahedra; the scaled Jacobian refers to straight edges.
        volume: Exact volume [m^3].

    Returns:
        ``count``, ``minimum_scaled_jacobian`` (0.707 for a regular tetrahedron), and ``volume_error``, the magnitude of
        the relative error of the volume.
    """
    return {
        "count": len(tetrahedra.cells),
        "minimum_scaled_jacobian": corner_quality(tetrahedra.points, tetrahedra.cells[:, :4]),
        "volume_error": abs(curved_volume(tetrahedra.points, tetrahedra.cells) / volume - 1.0),
    }


def least_jacobian(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return a lower bound of the Jacobian of each ten-node tetrahedron, relative to the straight one.

    The Jacobian is a cubic polynomial and thus not below its smallest Bernstein coefficient (Johnen, Remacle &
    Geuzaine 2013).

    Args:
        points: Node coordinates, shape (n, 3) [m].
        cells: Nodes of the tetrahedra in the order of Gmsh (four corners, six midside nodes), shape (c, 10).

    Returns:
        Lower bounds, shape (c,); 1 for straight edges with midside nodes in the middle.
    """
    corners = points[cells]
    straight = np.linalg.det(corners[:, 1:4] - corners[:, :1])
    values = np.stack([np.linalg.det(_jacobian(station, corners)) for station in CUBIC / 3.0], axis=1)
    multinomial = np.array([6.0 / np.prod([factorial(power) for power in powers]) for powers in CUBIC])
    bernstein = multinomial * np.prod((CUBIC / 3.0)[:, None, :] ** CUBIC, axis=2)
    return np.linalg.solve(bernstein, values.T).min(axis=0) / straight


def curved_volume(points: np.ndarray, cells: np.ndarray) -> float:
    """Return the exact total volume of ten-node tetrahedra [m^3].

    Args:
        points: Node coordinates, shape (n, 3) [m].
        cells: Four vertices and six midside nodes of each tetrahedron, shape (c, 10).
    """
    total = 0.0
    corners = points[cells]
    for station, weight in zip(STATIONS, WEIGHTS, strict=True):
        total += weight * float(np.linalg.det(_jacobian(station, corners)).sum())
    return total


def corner_quality(points: np.ndarray, tetrahedra: np.ndarray) -> float:
    """Return the smallest scaled Jacobian of straight tetrahedra: 0.707 if all are regular, <= 0 if one is inverted.

    Args:
        points: Vertices, shape (n, 3) [m].
        tetrahedra: Vertices of the tetrahedra, shape (c, 4).
    """
    corners = points[tetrahedra]
    smallest = np.inf
    for k in range(4):
        edges = corners[:, [j for j in range(4) if j != k]] - corners[:, [k]]
        units = edges / np.linalg.norm(edges, axis=2, keepdims=True)
        smallest = min(smallest, float(np.abs(np.linalg.det(units)).min()))
    return smallest


def write_tetrahedra(path: Path, name: str, tetrahedra: QuadraticTetrahedra) -> None:
    """Write tetrahedra as MSH 4.1 in metres.

    Args:
        path: The ``.msh`` file to write.
        name: Name of the joint; the volume is called ``solder@name``.
        tetrahedra: Ten-node tetrahedra with their facet sets, which are written, too.
    """
    with gmsh_model("free form"):
        first = 1
        groups = [(3, KIND, f"solder@{name}", tetrahedra.cells)]
        groups += [(2, FACE, face, nodes) for face, nodes in tetrahedra.faces.items()]
        for dimension, kind, group, nodes in groups:
            entity = gmsh.model.addDiscreteEntity(dimension)
            if dimension == 3:
                tags = np.arange(1, len(tetrahedra.points) + 1)
                gmsh.model.mesh.addNodes(3, entity, tags, tetrahedra.points.ravel())
            gmsh.model.mesh.addElementsByType(entity, kind, first + np.arange(len(nodes)), (nodes + 1).ravel())
            name_groups(dimension, {group: [entity]})
            first += len(nodes)
        write_msh(path)


def _unfold(points: np.ndarray, cells: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Straighten the edges of tetrahedra that would fold on a strongly curved surface."""
    while len(folded := cells[least_jacobian(points, cells) < LEAST_JACOBIAN]):
        middles = np.unique(folded[:, 4:])
        points = points.copy()
        points[middles] = points[ends[middles]].mean(axis=1)
    return points


def _with_middles(split: SplitTetrahedra, triangles: np.ndarray) -> np.ndarray:
    pairs = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    return np.hstack([triangles, split.middles(pairs)])


def _jacobian(station: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return Jacobian matrices (c, 3, 3) at a point of tetrahedra with nodes (c, 10, 3)."""
    slopes = _slopes(station)
    return np.einsum("na,cni->cai", slopes[:, 1:] - slopes[:, :1], corners)


def _slopes(station: np.ndarray) -> np.ndarray:
    """Return the derivatives of the shape functions with respect to the barycentric coordinates, shape (10, 4)."""
    slopes = np.zeros((10, 4))
    slopes[np.arange(4), np.arange(4)] = 4.0 * station - 1.0
    for node, (first, second) in enumerate(EDGES[ORDER], start=4):
        slopes[node, first], slopes[node, second] = 4.0 * station[second], 4.0 * station[first]
    return slopes
