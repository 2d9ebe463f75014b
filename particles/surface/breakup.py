"""Break-up of liquid surfaces: fans of triangles that share only a vertex, parts that are too small, points outside."""

from math import inf

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import find_near
from reflowshock.particles.core.winding_numbers import WindingNumbers
from reflowshock.particles.surface.cloud_level_set import CannotRebuild, boundary_loops
from reflowshock.particles.surface.morphological_closing import connected_groups, part_of_vertex

# Points farther from all vertices than this multiple of the given distance are classified by winding numbers.
FAR = 3.0


def split_fans(triangles: Indices) -> tuple[Indices, Indices]:
    """Give every fan of triangles about a vertex a copy of the vertex, if fans share the vertex but no edge.

    Contact lines that meet in a point separate there, or become one.

    Args:
        triangles: Triangles, shape (t, 3); an edge belongs to at most two of them, in opposite senses.

    Returns:
        Old vertex of each new one, shape (k,), and triangles of new vertices, shape (t, 3).
    """
    corners = np.arange(triangles.size).reshape(-1, 3)
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    size = int(triangles.max(initial=0)) + 1
    vertex = triangles.ravel().astype(np.int64)
    forward, backward = vertex[start] * size + vertex[end], vertex[end] * size + vertex[start]
    order = np.argsort(forward)
    mate = order[np.minimum(np.searchsorted(forward[order], backward), len(order) - 1)]
    paired = forward[mate] == backward
    mate = mate[paired]
    pairs = np.concatenate((start[paired], end[paired])), np.concatenate((end[mate], start[mate]))
    fan = connected_groups(*pairs, triangles.size)
    old = np.empty(int(fan.max(initial=-1)) + 1, np.int32)
    old[fan] = vertex
    return old, fan.reshape(-1, 3).astype(np.int32)


def with_contact_lines(triangles: Indices) -> tuple[Indices, Indices, tuple[Indices, ...]]:
    """Renumber the vertices in use and find contact lines; contact lines that meet in a point are separated.

    Args:
        triangles: Triangles, shape (t, 3).

    Returns:
        Old vertex of each new one, shape (k,), triangles of new vertices, shape (t, 3), and the vertices along each
        contact line.

    Raises:
        CannotRebuild: More than two triangles meet in an edge.
    """
    used, numbers = np.unique(triangles, return_inverse=True)
    triangles = numbers.reshape(-1, 3).astype(np.int32)
    try:
        return used, triangles, boundary_loops(triangles)
    except CannotRebuild:
        old, triangles = split_fans(triangles)
        return used[old], triangles, boundary_loops(triangles)


def measure_parts(points: Floats, triangles: Indices) -> tuple[Indices, Floats]:
    """Compute the volumes of the connected parts of a surface that the wall z = 0 closes.

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).

    Returns:
        Number of the part of each triangle, shape (t,), and volume of each part [m^3], negative for cavities.
    """
    part = part_of_vertex(triangles, len(points))[triangles[:, 0]]
    volumes = np.zeros(int(part.max()) + 1)
    np.add.at(volumes, part, np.linalg.det(points[triangles]) / 6.0)
    return part, volumes


def find_largest_part(points: Floats, triangles: Indices) -> Floats:
    """Return the vertices (k, 3) [m] of the part with the largest volume.

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3); the wall z = 0 closes the surface.
    """
    part, volumes = measure_parts(points, triangles)
    return points[np.unique(triangles[part == volumes.argmax()])]


def find_small_parts(points: Floats, triangles: Indices, least: float) -> tuple[NDArray[np.bool_], float]:
    """Find the parts of a surface with less than a volume, except the largest part and cavities.

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
        least: Volume below which a part is small [m^3].

    Returns:
        Whether each triangle belongs to a small part, shape (t,), and the total volume of these parts [m^3].
    """
    part, volumes = measure_parts(points, triangles)
    is_small = (volumes >= 0.0) & (volumes < least)
    is_small[volumes.argmax()] = False
    return is_small[part], float(volumes[is_small].sum())


def are_outside(
    points: Floats, vertices: Floats, triangles: Indices, normals: Floats, distance: float
) -> NDArray[np.bool_]:
    """Return whether points are farther than a distance outside the nearest vertex of a surface, shape (n,).

    Points far from all vertices are outside if the winding number of the surface, closed by the wall below, is not
    positive there.

    Args:
        points: Points, shape (n, 3) [m].
        vertices: Vertices of the surface, shape (m, 3) [m].
        triangles: Triangles, shape (t, 3), with edges shorter than three times the distance.
        normals: Outward unit normals of the vertices, shape (m, 3).
        distance: Distance [m], at least a few tenths of an edge, since the nearest vertex stands for the surface.
    """
    nearest = np.full(len(points), -1)
    _find_nearest(vertices, points, find_near(vertices, points, FAR * distance), nearest)
    outside = ((points - vertices[nearest]) * normals[nearest]).sum(axis=1) > distance
    far = nearest < 0
    if far.any():
        outside[far] = WindingNumbers.of(vertices, triangles, distance).at(points[far]) <= 0
    return outside


@njit(cache=True)
def _find_nearest(vertices, points, lists, nearest):
    """Write the nearest vertex of each point that is in the list of a vertex."""
    (offsets, indices), least = lists, np.full(points.shape[0], inf)
    for v in range(vertices.shape[0]):
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            x, y, z = points[j, 0] - vertices[v, 0], points[j, 1] - vertices[v, 1], points[j, 2] - vertices[v, 2]
            square = x * x + y * y + z * z
            if square < least[j]:
                least[j], nearest[j] = square, v
