"""Tetrahedra that fill a body of any shape; their boundary off the walls is the tracked surface, face by face.

The boundary of the Delaunay tetrahedra of all particles, less those outside the surface (by winding number), differs
from the surface where that is not Delaunay itself. The difference is a closed surface, or ends on a wall. Its cone is
added: tetrahedra from one of its vertices. Some of these are inverted and count negatively, so that the volume and its
gradient equal the volume within the surface and its gradient exactly.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from reflowshock.arrays import Indices
from reflowshock.particles.core import winding_numbers
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.surface_measure import wall_corners
from reflowshock.particles.core.tetrahedra import boundary_triangles, cell_volumes, tetrahedralise, thick_cells

Mask = NDArray[np.bool_]


def fill_with_tetrahedra(body: Body) -> Indices:
    """Return tetrahedra between the particles of a body whose boundary is its surface, shape (t, 4).

    Their corners are particle numbers; faces on walls belong to the boundary, too.

    Args:
        body: Liquid body, with positions of its particles and triangles of its free surface.
    """
    cells = tetrahedralise(body.points, body.cloud.spacing)
    wall = body.cloud.wall
    cells = cells[~_on_one_wall(wall, cells)]
    cells = cells[_inside(body, cells)]
    faces = boundary_triangles(cells)
    faces = faces[~_on_one_wall(wall, faces)]
    difference, start = _difference(body.triangles, faces)
    return cells if len(difference) == 0 else np.concatenate((cells, _cones(difference, start, wall)))


def _on_one_wall(wall: NDArray[np.int8], simplices: Indices) -> Mask:
    """Return whether all corners of each simplex lie on the same wall."""
    walls = wall[simplices]
    return (walls[:, 0] >= 0) & (walls == walls[:, :1]).all(axis=1)


def _inside(body: Body, cells: Indices) -> Mask:
    """Return whether tetrahedra lie inside the surface; only those with all corners on the boundary may lie outside.

    Flat ones among these count as outside; where one is inside, a cone replaces it.
    """
    cloud, points = body.cloud, body.points
    bounding = (np.arange(len(points)) < cloud.surface_count) | (cloud.wall >= 0)
    loose = ~bounding[cells].all(axis=1)
    thick = thick_cells(cell_volumes(points, cells))
    doubtful = thick[~loose[thick]]
    walls = [wall_corners(points, *on_wall) for on_wall in zip(cloud.rings, body.plates, strict=True)]
    corners = np.concatenate([points[body.triangles], *walls])
    inside = loose
    inside[doubtful] = winding_numbers.at_points(points[cells[doubtful]].mean(axis=1), corners) > 0.5
    return inside


def _oriented(triangles: Indices) -> Indices:
    """Rotate the vertices of each triangle so that the smallest comes first."""
    first = np.argmin(triangles, axis=1)[:, None]
    return np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)


def _difference(triangles: Indices, others: Indices) -> tuple[Indices, int]:
    """Return triangles not among the others, then reversed others not among them, and the start of the latter."""
    both = np.concatenate((_oriented(triangles), _oriented(others)))
    _, first, count = np.unique(both, axis=0, return_index=True, return_counts=True)
    alone = np.sort(first[count == 1])
    is_first = alone < len(triangles)
    return np.concatenate((both[alone[is_first]], both[alone[~is_first]][:, ::-1])), int(is_first.sum())


def _components(numbers: Indices, joins: Mask) -> Indices:
    """Return the connected components of triangles with edges (t, 3), connected by edges in the mask ``joins``."""
    triangle, number = np.repeat(np.arange(len(numbers)), 3), numbers.ravel()
    keep = joins[number]
    shares = sparse.csr_matrix((np.ones(keep.sum()), (triangle[keep], number[keep])), (len(numbers), len(joins)))
    return connected_components(shares @ shares.T, directed=False)[1]


def _parts(triangles: Indices, start: int) -> Indices:
    """Return the closed part that each triangle of a difference belongs to, shape (t,).

    Two patches with the same corners, one of each surface, are one or a few flipped edges and form a separate part, so
    that adjacent flips, as on a lattice, do not make one large part. The remainder is split by connectivity.
    """
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    numbers = np.unique(edges, axis=0, return_inverse=True)[1].reshape(-1, 3)
    first, second = (
        np.bincount(side.ravel(), minlength=numbers.max() + 1) for side in (numbers[:start], numbers[start:])
    )
    patch = _components(numbers, (first == 0) | (second == 0))
    mate = _mates(triangles, numbers, patch)
    part, left = mate[patch], mate[patch] < 0
    part[left] = len(triangles) + _components(numbers[left], np.ones(len(first), bool))
    return np.unique(part, return_inverse=True)[1].reshape(-1)


def _mates(triangles: Indices, numbers: Indices, patch: Indices) -> Indices:
    """Return the smaller number of each patch and the patch with the same corners that closes it, -1 without one."""
    order = np.argsort(patch, kind="stable")
    members = np.split(order, np.cumsum(np.bincount(patch))[:-1])
    mate, patches_by_corners = np.full(len(members), -1), dict[bytes, int]()
    for number, member in enumerate(members):
        first = patches_by_corners.setdefault(np.unique(triangles[member]).tobytes(), number)
        pair = numbers[np.concatenate((member, members[first]))]
        if first != number and mate[first] < 0 and (np.unique(pair, return_counts=True)[1] == 2).all():
            mate[number] = mate[first] = first
    return mate


def _cones(triangles: Indices, start: int, wall: NDArray[np.int8]) -> Indices:
    """Return tetrahedra between each part and its apex: the vertex of most of its triangles, preferably on a wall."""
    part = _parts(triangles, start)
    triangle = np.repeat(np.arange(len(triangles)), 3)
    shape = (int(part.max()) + 1, len(wall))
    votes = sparse.csr_matrix((np.ones(len(triangle)), (part[triangle], triangles.ravel())), shape=shape)
    votes = votes + votes.multiply((wall >= 0)[None] * float(len(triangles)))
    apex = np.asarray(votes.argmax(axis=1)).ravel()[part].astype(np.int32)
    cones = np.column_stack((apex, triangles))
    return cones[(triangles != apex[:, None]).all(axis=1)]
