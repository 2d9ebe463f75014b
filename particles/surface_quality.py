"""Keeping the triangles of the tracked surface well shaped: tangential smoothing and Delaunay edge flips."""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]

SMOOTHING = 0.3
FLIP_MARGIN = 1e-2
FLIP_PASSES = 4


@njit(cache=True)
def _centroid_offsets(points, triangles, count):
    """Area-weighted mean of the centroids of a vertex's triangles, minus the vertex; and the vertex normal."""
    offset = np.zeros((count, 3))
    normal = np.zeros((count, 3))
    area = np.zeros(count)
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t]
        cross = np.cross(points[b] - points[a], points[c] - points[a])
        size = np.sqrt((cross**2).sum())
        centroid = (points[a] + points[b] + points[c]) / 3.0
        for v in (a, b, c):
            offset[v] += size * (centroid - points[v])
            normal[v] += cross
            area[v] += size
    for v in range(count):
        offset[v] /= area[v]
        normal[v] /= np.sqrt((normal[v] ** 2).sum())
    return offset, normal


def vertex_normals(points: Floats, triangles: Indices, count: int) -> Floats:
    """Area-weighted outward unit normals of the first `count` particles, `(count, 3)`."""
    return _centroid_offsets(points, triangles, count)[1]


def smoothing_offsets(points: Floats, triangles: Indices, count: int, rings: Sequence[Indices]) -> Floats:
    """Tangential displacements `(count, 3)` [m] that even out the triangles and leave the shape.

    Vertices of the free surface go towards the mean of their triangles' centroids within the tangent plane,
    vertices of a contact line towards the middle of their neighbours along the line.
    """
    offset, normal = _centroid_offsets(points, triangles, count)
    offset -= (offset * normal).sum(axis=1)[:, None] * normal
    for ring in rings:
        before, after = points[np.roll(ring, 1)], points[np.roll(ring, -1)]
        along = after - before
        along /= np.linalg.norm(along, axis=1)[:, None]
        middle = 0.5 * (before + after) - points[ring]
        offset[ring] = (middle * along).sum(axis=1)[:, None] * along
    return SMOOTHING * offset


@njit(cache=True)
def _half_edges(triangles, count):
    """Keys of the half edges opposite to each corner, sorted, with the half edge numbers."""
    keys = np.empty(3 * triangles.shape[0], np.int64)
    for t in range(triangles.shape[0]):
        for k in range(3):
            i, j = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            keys[3 * t + k] = np.int64(min(i, j)) * count + max(i, j)
    order = np.argsort(keys, kind="mergesort")
    return keys[order], order


@njit(cache=True)
def _angle(points, apex, i, j):
    u, v = points[i] - points[apex], points[j] - points[apex]
    return np.arctan2(np.sqrt((np.cross(u, v) ** 2).sum()), (u * v).sum())


@njit(cache=True)
def _normal(points, i, j, k):
    return np.cross(points[j] - points[i], points[k] - points[i])


@njit(cache=True)
def _flip_pass(points, triangles, on_ring, margin):
    """Flip edges whose opposite angles exceed pi, at most one edge a triangle; return the number of flips."""
    keys, order = _half_edges(triangles, points.shape[0])
    touched = np.zeros(triangles.shape[0], np.bool_)
    flips = 0
    for e in range(keys.shape[0] - 1):
        if keys[e] != keys[e + 1]:
            continue
        s, t = order[e] // 3, order[e + 1] // 3
        if touched[s] or touched[t]:
            continue
        p, q = triangles[s, order[e] % 3], triangles[t, order[e + 1] % 3]
        i, j = triangles[s, (order[e] % 3 + 1) % 3], triangles[s, (order[e] % 3 + 2) % 3]
        if _angle(points, p, i, j) + _angle(points, q, i, j) < np.pi + margin or (on_ring[p] and on_ring[q]):
            continue
        new_key = np.int64(min(p, q)) * points.shape[0] + max(p, q)
        found = np.searchsorted(keys, new_key)
        if found < keys.shape[0] and keys[found] == new_key:
            continue
        old = _normal(points, p, i, j) + _normal(points, q, j, i)
        if (_normal(points, p, i, q) * old).sum() <= 0.0 or (_normal(points, p, q, j) * old).sum() <= 0.0:
            continue
        triangles[s, 0], triangles[s, 1], triangles[s, 2] = p, i, q
        triangles[t, 0], triangles[t, 1], triangles[t, 2] = p, q, j
        touched[s] = touched[t] = True
        flips += 1
    return flips


def flip_to_delaunay(points: Floats, triangles: Indices, rings: Sequence[Indices]) -> tuple[Indices, int]:
    """Flip edges until the surface is intrinsically Delaunay up to a margin.

    An edge is kept where the flip would join two vertices of contact lines, double an edge or fold the surface.

    Returns:
        The new triangles `(t, 3)` and the number of flips.
    """
    result = triangles.copy()
    on_ring = np.zeros(len(points), np.bool_)
    for ring in rings:
        on_ring[ring] = True
    total = 0
    for _ in range(FLIP_PASSES):
        flips = _flip_pass(points, result, on_ring, FLIP_MARGIN)
        total += flips
        if flips == 0:
            break
    return result, total
