"""Quality of surface triangles: tangential smoothing and Delaunay edge flips."""

from collections.abc import Sequence

import numpy as np
from numba import njit

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.surface_measure import area_vector

# Share of the way to the smoothed position in one pass.
SMOOTHING = 0.3
# Angle beyond pi from which on an edge is flipped [rad].
FLIP_MARGIN = 1e-2
FLIP_PASSES = 4
# Area [m^2] that replaces a vanishing sum: triangles folded onto each other give their vertex no normal.
LEAST = 1e-300


@njit(cache=True)
def _angle(points, apex, i, j):
    """Return the angle of the triangle apex-i-j at its apex [rad]."""
    x, y, z = area_vector(points, apex, i, j)
    along = 0.0
    for d in range(3):
        along += (points[i, d] - points[apex, d]) * (points[j, d] - points[apex, d])
    return np.arctan2(np.sqrt(x * x + y * y + z * z), along)


@njit(cache=True)
def _folds(points, corners):
    """Return whether flipping the edge i-j of the triangles p-i-j and q-j-i would fold the surface."""
    p, q, i, j = corners
    before, opposite = area_vector(points, p, i, j), area_vector(points, q, j, i)
    first, second = area_vector(points, p, i, q), area_vector(points, p, q, j)
    along_first, along_second = 0.0, 0.0
    for d in range(3):
        along_first += first[d] * (before[d] + opposite[d])
        along_second += second[d] * (before[d] + opposite[d])
    return along_first <= 0.0 or along_second <= 0.0


@njit(cache=True)
def _centroid_offsets(points, triangles, count):
    """Return the area-weighted mean of the centroids about each vertex minus the vertex, and the unit normals."""
    offset, normal, area = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t]
        cross = area_vector(points, a, b, c)
        size = np.sqrt(cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2)
        for v in (a, b, c):
            area[v] += size
            for d in range(3):
                centroid = (points[a, d] + points[b, d] + points[c, d]) / 3.0
                offset[v, d] += size * (centroid - points[v, d])
                normal[v, d] += cross[d]
    for v in range(count):
        length = np.sqrt(normal[v, 0] ** 2 + normal[v, 1] ** 2 + normal[v, 2] ** 2)
        for d in range(3):
            offset[v, d] /= max(area[v], LEAST)
            normal[v, d] /= max(length, LEAST)
    return offset, normal


def vertex_normals(points: Floats, triangles: Indices, count: int) -> Floats:
    """Return area-weighted outward unit normals of the first ``count`` points, shape (count, 3).

    Args:
        points: Points, shape (n, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3), of vertices below ``count``.
        count: Number of vertices, which come first.
    """
    return _centroid_offsets(points, triangles, count)[1]


def smoothing_offsets(
    points: Floats,
    triangles: Indices,
    count: int,
    rings: Sequence[Indices],
    planes: Sequence[tuple[int, Indices]] = (),
) -> Floats:
    """Return tangential displacements that smooth the triangles and keep the shape, shape (count, 3) [m].

    Vertices of the free surface move towards the mean of their triangles' centroids within the tangent plane, vertices
    of a contact line towards the middle of their neighbours along the line.

    Args:
        points: Points, shape (n, 3) [m], the vertices first.
        triangles: Triangles, shape (t, 3).
        count: Number of vertices.
        rings: Contact lines as vertices in order, shape (k,) each; they end on the planes of symmetry if there are any.
        planes: Axis of each plane of symmetry (0 for x = 0, 1 for y = 0) and the vertices on it, shape (j,).
    """
    offset, normal = _centroid_offsets(points, triangles, count)
    for axis, vertices in planes:  # half of the triangles about these vertices is behind the plane
        offset[vertices, axis] = normal[vertices, axis] = 0.0
        normal[vertices] /= np.linalg.norm(normal[vertices], axis=1)[:, None]
    offset -= (offset * normal).sum(axis=1)[:, None] * normal
    for ring in rings:
        before, after = points[np.roll(ring, 1)], points[np.roll(ring, -1)]
        along = after - before
        along /= np.linalg.norm(along, axis=1)[:, None]
        middle = 0.5 * (before + after) - points[ring]
        offset[ring] = (middle * along).sum(axis=1)[:, None] * along
        if planes:
            offset[ring[[0, -1]]] = 0.0
    return SMOOTHING * offset


def _half_edges(triangles: Indices, count: int) -> tuple[Indices, Indices]:
    """Return sorted keys of the half edges opposite to each corner, and the numbers of the half edges."""
    i, j = np.roll(triangles, -1, axis=1).astype(np.int64), np.roll(triangles, -2, axis=1)
    keys = (np.minimum(i, j) * count + np.maximum(i, j)).ravel()
    order = np.argsort(keys, kind="stable")
    return keys[order], order


@njit(cache=True)
def _excess_triangles(triangles, on_ring):
    """Return the number of triangles around each vertex minus six, on a contact line minus three."""
    result = np.empty(on_ring.shape[0])
    for vertex in range(on_ring.shape[0]):
        result[vertex] = -3.0 if on_ring[vertex] else -6.0
    for t in range(triangles.shape[0]):
        for k in range(3):
            result[triangles[t, k]] += 1.0
    return result


@njit(cache=True)
def _flip_pass(points, triangles, half_edges, on_ring, worth):
    """Flip edges whose opposite angles exceed pi, at most one edge a triangle; return the number of flips.

    The angles are increased by ``worth`` for each triangle by which the flip balances the numbers of triangles around
    its four vertices: minus half the change of the sum of squares of their excess. A flip back has the opposite sign.
    """
    keys, order = half_edges
    touched = np.zeros(triangles.shape[0], np.bool_)
    excess = _excess_triangles(triangles, on_ring)
    made, flips = np.empty(triangles.shape[0], np.int64), 0
    for e in range(keys.shape[0] - 1):
        if keys[e] != keys[e + 1]:
            continue
        s, t = order[e] // 3, order[e + 1] // 3
        if touched[s] or touched[t]:
            continue
        p, q = triangles[s, order[e] % 3], triangles[t, order[e + 1] % 3]
        i, j = triangles[s, (order[e] % 3 + 1) % 3], triangles[s, (order[e] % 3 + 2) % 3]
        angles = _angle(points, p, i, j) + _angle(points, q, i, j)
        angles += worth * (excess[i] + excess[j] - excess[p] - excess[q] - 2.0)
        if angles < np.pi + FLIP_MARGIN or (on_ring[p] and on_ring[q]):
            continue
        new_key = np.int64(min(p, q)) * points.shape[0] + max(p, q)
        position = np.searchsorted(keys, new_key)
        exists = position < keys.shape[0] and keys[position] == new_key
        for flip in range(flips):
            exists |= made[flip] == new_key
        if exists:
            continue
        if _folds(points, (p, q, i, j)):
            continue
        triangles[s, 0], triangles[s, 1], triangles[s, 2] = p, i, q
        triangles[t, 0], triangles[t, 1], triangles[t, 2] = p, q, j
        touched[s] = touched[t] = True
        for vertex, change in ((i, -1.0), (j, -1.0), (p, 1.0), (q, 1.0)):
            excess[vertex] += change
        made[flips] = new_key
        flips += 1
    return flips


def flip_to_delaunay(
    points: Floats, triangles: Indices, rings: Sequence[Indices], worth: float = 0.0
) -> tuple[Indices, int]:
    """Flip edges until the surface is intrinsically Delaunay up to a margin.

    An edge is not flipped if that would connect two vertices of contact lines, double an edge or fold the surface.

    Args:
        points: Points, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        rings: Contact lines as vertices in order, shape (k,) each; may be empty.
        worth: Angle by which the Delaunay criterion is relaxed for each triangle that a flip moves from vertices with
            more than six to vertices with fewer [rad].

    Returns:
        New triangles, shape (t, 3), and the number of flips.
    """
    result = triangles.copy()
    on_ring = np.zeros(len(points), np.bool_)
    for ring in rings:
        on_ring[ring] = True
    total = 0
    for _ in range(FLIP_PASSES):
        flips = _flip_pass(points, result, _half_edges(result, len(points)), on_ring, worth)
        total += flips
        if flips == 0:
            break
    return result, total
