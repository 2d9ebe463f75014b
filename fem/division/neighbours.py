"""Coarse models of neighbouring packages: boxes on solder posts, tied to the upper face of the board.

A post has the cross-section of its joint and shares nodes with the substrate, whose grid contains the edges of all
posts. Each layer is one element high, which represents bending correctly with incompatible modes. Die edges move to
grid lines that are closer than ``CLOSE``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import HEXAHEDRON
from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.column import CYCLIC
from reflowshock.fem.mesh.mesh import MeshData, append, boundary_facets, without_unused_nodes
from reflowshock.fem.problem.fittings import Neighbour
from reflowshock.materials.roles import role_of_part

CLOSE = 0.2  # smallest distance of grid lines relative to the pitch
ROUNDING = 1e-9  # distance relative to the package below which lines coincide
LAYERS = ("solder", "substrate", "die")


def with_neighbours(mesh: MeshData, neighbours: Mapping[str, Neighbour]) -> MeshData:
    """Add neighbouring packages to the board of a mesh, with the facet sets that ``tie_joints`` needs.

    Args:
        mesh: Mesh with the board.
        neighbours: Name -> position and sizes of a package on the same board; empty leaves the mesh unchanged.

    Raises:
        MeshError: A package lies outside the board.
    """
    for name, item in neighbours.items():
        package = _neighbour_mesh(name, item)
        mesh = append([mesh, package])
        below = _facets_below(mesh, package.points[package.facet_nodes(f"slave@neighbour_{name}")])
        if not len(below):
            raise MeshError(f"packages.{name}: there is no board below it")
        mesh = replace(mesh, facets=mesh.facets | {f"master@neighbour_{name}": below})
    return mesh


def _neighbour_mesh(name: str, item: Neighbour) -> MeshData:
    """Return the mesh of a package, with the lower faces of its posts as facet set ``slave@neighbour_NAME``."""
    posts = [_post_edges(item, *axis) for axis in zip(item.at, (item.columns, item.rows), strict=True)]
    lines = [_grid_lines(posts[k], (item.at[k], item.substrate[k], item.die[k]), item.pitch) for k in range(2)]
    heights = np.cumsum([0.0, item.standoff, item.substrate[2], item.die[2]])
    points = np.stack(np.meshgrid(*lines, heights, indexing="ij"), axis=-1).reshape(-1, 3)
    shape = tuple(len(axis) for axis in (*lines, heights))
    number = np.arange(len(points), dtype=np.int32).reshape(shape)
    side = slice(None, -1), slice(1, None)
    corners = [number[side[a & 1], side[a >> 1 & 1], side[a >> 2]].ravel() for a in range(HEXAHEDRON.nodes)]
    cells, part = np.stack(corners, axis=1), np.tile(np.arange(3, dtype=np.int32), (shape[0] - 1) * (shape[1] - 1))
    x, y = points[cells].mean(axis=1)[:, :2].T
    in_post = _within(x, posts[0]) & _within(y, posts[1])
    in_die = (np.abs(x - item.at[0]) < 0.5 * item.die[0]) & (np.abs(y - item.at[1]) < 0.5 * item.die[1])
    is_solid = np.choose(part, [in_post, True, in_die])
    names = tuple(f"{layer}_{name}" for layer in LAYERS)
    feet = cells[is_solid & (part == 0)][:, [0, 1, 3, 2]]
    mesh = MeshData(points, cells[is_solid], part[is_solid], names, {f"slave@neighbour_{name}": feet})
    return without_unused_nodes(mesh)[0]


def _within(places: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which coordinates, shape (n,), lie in one of the intervals, shape (k, 2)."""
    first = np.searchsorted(edges[:, 0], places) - 1
    return np.asarray((first >= 0) & (places < edges[first, 1]))


def _post_edges(item: Neighbour, centre: float, count: int) -> NDArray[np.float64]:
    """Return start and end of each post along an axis, shape (count, 2) [m]."""
    middle = centre + item.pitch * (np.arange(count) - 0.5 * (count - 1))
    return middle[:, None] + 0.5 * item.post * np.array([-1.0, 1.0])


def _grid_lines(edges: NDArray[np.float64], box: Sequence[float], pitch: float) -> NDArray[np.float64]:
    """Return the grid lines along an axis [m]: edges of posts, substrate and die, at most one pitch apart.

    Args:
        edges: Start and end of the posts, shape (k, 2) [m].
        box: Centre of the package, lengths of substrate and die [m].
        pitch: Largest distance between lines [m].
    """
    centre, outer, inner = box
    lines = np.unique(np.concatenate([edges.ravel(), centre + 0.5 * outer * np.array([-1.0, 1.0])]))
    lines = lines[np.concatenate([[True], np.diff(lines) > ROUNDING * outer])]
    for edge in centre + 0.5 * inner * np.array([-1.0, 1.0]):
        if np.abs(lines - edge).min() > CLOSE * pitch:
            lines = np.sort(np.append(lines, edge))
    counts = np.ceil(np.diff(lines) / pitch - ROUNDING).astype(int)
    pieces = [np.linspace(a, b, n, endpoint=False) for (a, b), n in zip(pairwise(lines), counts, strict=True)]
    return np.concatenate([*pieces, lines[-1:]])


def _facets_below(mesh: MeshData, feet: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return the facets of the board's upper face below points, shape (n, 3) [m], in cyclic order, shape (nf, 4)."""
    board = mesh.cells[mesh.in_parts(lambda name: role_of_part(name) == "board" and "@" not in name)]
    corners = mesh.points[board]
    low, high = feet.min(axis=0), feet.max(axis=0)
    near = ((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low)).all(axis=1)
    if not near.any():
        return np.empty((0, 4), np.int32)
    facets = boundary_facets(board[near])
    flat = (np.abs(mesh.points[facets][:, :, 2] - low[2]) <= ROUNDING * np.ptp(mesh.points)).all(axis=1)
    return facets[flat][:, CYCLIC]
