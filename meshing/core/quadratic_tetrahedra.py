"""Ten-node tetrahedra of a free-form body, for other codes: curved along its surface, straight inside."""

from dataclasses import dataclass
from itertools import product
from math import factorial
from pathlib import Path

import gmsh
import numpy as np

from reflowshock.meshing.core.gmsh_session import gmsh_model, name_groups, write_msh
from reflowshock.meshing.core.split_tetrahedra import EDGES, SplitTetrahedra

KIND, FACE = 11, 9  # Gmsh's ten-node tetrahedron and six-node triangle
ORDER = np.array([0, 3, 1, 2, 5, 4])  # Gmsh's edges 01 12 20 03 23 13 among ours, 01 02 03 12 13 23
# Exact for cubics (Keast 1986, five points): barycentric coordinates and weights of the unit tetrahedron.
STATIONS = np.vstack([np.full(4, 0.25), np.full((4, 4), 1.0 / 6.0) + np.eye(4) / 3.0])
WEIGHTS = np.array([-0.8, 0.45, 0.45, 0.45, 0.45]) / 6.0
CUBIC = np.array([powers for powers in product(range(4), repeat=4) if sum(powers) == 3])  # of its Bernstein polynomials
LEAST_JACOBIAN = 0.05  # of a curved tetrahedron, over that of the straight one


@dataclass(frozen=True, slots=True)
class QuadraticTetrahedra:
    """Ten-node tetrahedra.

    Attributes:
        points: (n, 3) [m].
        cells: (c, 10) in Gmsh's order.
        faces: name of a facet set -> (f, 6) in Gmsh's order.
    """

    points: np.ndarray
    cells: np.ndarray
    faces: dict[str, np.ndarray]


def quadratic_tetrahedra(
    split: SplitTetrahedra, points: np.ndarray, tetrahedra: np.ndarray, faces: dict[str, np.ndarray]
) -> QuadraticTetrahedra:
    """Make ten-node tetrahedra of those that were split.

    Args:
        split: their hexahedra.
        points: (n, 3) of these, where they are now [m]; those at the middles of edges of ``faces`` are taken.
        tetrahedra: (c, 4).
        faces: name -> triangles (f, 3) of the surface.
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
    """Return number, smallest scaled Jacobian of the straight ones, and relative error of the volume [m^3]."""
    return {
        "count": len(tetrahedra.cells),
        "minimum_scaled_jacobian": corner_quality(tetrahedra.points, tetrahedra.cells[:, :4]),
        "volume_error": abs(curved_volume(tetrahedra.points, tetrahedra.cells) / volume - 1.0),
    }


def least_jacobian(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return a lower bound of the Jacobian of ten-node tetrahedra (c, 10), over that of the straight ones (c,).

    It is a cubic, so no smaller than the least of its coefficients in Bernstein polynomials (Johnen, Remacle & Geuzaine
    2013).
    """
    corners = points[cells]
    straight = np.linalg.det(corners[:, 1:4] - corners[:, :1])
    values = np.stack([np.linalg.det(_jacobian(station, corners)) for station in CUBIC / 3.0], axis=1)
    ways = np.array([6.0 / np.prod([factorial(power) for power in powers]) for powers in CUBIC])
    bernstein = ways * np.prod((CUBIC / 3.0)[:, None, :] ** CUBIC, axis=2)
    return np.linalg.solve(bernstein, values.T).min(axis=0) / straight


def curved_volume(points: np.ndarray, cells: np.ndarray) -> float:
    """Volume of ten-node tetrahedra (c, 10) [m^3], exact."""
    total = 0.0
    corners = points[cells]
    for station, weight in zip(STATIONS, WEIGHTS, strict=True):
        total += weight * float(np.linalg.det(_jacobian(station, corners)).sum())
    return total


def corner_quality(points: np.ndarray, tetrahedra: np.ndarray) -> float:
    """Smallest scaled Jacobian of the straight tetrahedra (c, 4): 0.707 at the corners of a regular one."""
    corners = points[tetrahedra]
    smallest = np.inf
    for k in range(4):
        edges = corners[:, [j for j in range(4) if j != k]] - corners[:, [k]]
        units = edges / np.linalg.norm(edges, axis=2, keepdims=True)
        smallest = min(smallest, float(np.abs(np.linalg.det(units)).min()))
    return smallest


def write_tetrahedra(path: Path, name: str, tetrahedra: QuadraticTetrahedra) -> None:
    """Write them as Gmsh 4.1 in metres: the volume ``solder@name`` and its facet sets."""
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
    """Straighten the edges of tetrahedra that are flat on a surface so curved that they would fold."""
    while len(folded := cells[least_jacobian(points, cells) < LEAST_JACOBIAN]):
        middles = np.unique(folded[:, 4:])
        points = points.copy()
        points[middles] = points[ends[middles]].mean(axis=1)
    return points


def _with_middles(split: SplitTetrahedra, triangles: np.ndarray) -> np.ndarray:
    pairs = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    return np.hstack([triangles, split.middles(pairs)])


def _jacobian(station: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Jacobian matrices (c, 3, 3) at a place of tetrahedra with nodes (c, 10, 3)."""
    slopes = _slopes(station)
    return np.einsum("na,cni->cai", slopes[:, 1:] - slopes[:, :1], corners)


def _slopes(station: np.ndarray) -> np.ndarray:
    """Derivatives (10, 4) of the shape functions with respect to the barycentric coordinates."""
    slopes = np.zeros((10, 4))
    slopes[np.arange(4), np.arange(4)] = 4.0 * station - 1.0
    for node, (first, second) in enumerate(EDGES[ORDER], start=4):
        slopes[node, first], slopes[node, second] = 4.0 * station[second], 4.0 * station[first]
    return slopes
