"""Surfaces that break up: parts that hang together in a vertex alone, parts that are too small, points outside."""

from math import inf

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import find_near
from reflowshock.particles.core.windings import Windings
from reflowshock.particles.surface.closing import groups, part_of_vertex
from reflowshock.particles.surface.cloud_level_set import CannotRebuild, boundary_loops

# In the distance outside a surface that is judged: what is farther from all vertices is judged by windings.
FAR = 3.0


def unpinched(triangles: Indices) -> tuple[Indices, Indices]:
    """Give every fan of triangles about a vertex a vertex of its own, where they share that vertex and no edge.

    So contact lines that meet in a point part there, or become one.

    Args:
        triangles: `(t, 3)`, an edge in at most two of them, in opposite senses.

    Returns:
        The old vertex that each new one is at `(k,)`, and triangles `(t, 3)` of new vertices.
    """
    corners = np.arange(triangles.size).reshape(-1, 3)
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    size = int(triangles.max(initial=0)) + 1
    vertex = triangles.ravel().astype(np.int64)
    there, back = vertex[start] * size + vertex[end], vertex[end] * size + vertex[start]
    order = np.argsort(there)
    place = np.minimum(np.searchsorted(there[order], back), len(order) - 1)
    mate = order[place]
    paired = there[mate] == back
    mate = mate[paired]
    fan = groups(np.concatenate((start[paired], end[paired])), np.concatenate((end[mate], start[mate])), triangles.size)
    old = np.empty(int(fan.max(initial=-1)) + 1, np.int32)
    old[fan] = vertex
    return old, fan.reshape(-1, 3).astype(np.int32)


def with_contact_lines(triangles: Indices) -> tuple[Indices, Indices, tuple[Indices, ...]]:
    """Number the vertices that triangles have, and find contact lines; where these meet in a point they part there.

    Args:
        triangles: `(t, 3)`.

    Returns:
        The old vertex that each new one is at `(k,)`, triangles `(t, 3)` of new vertices, contact lines of them.

    Raises:
        CannotRebuild: more than two triangles meet in an edge.
    """
    used, numbers = np.unique(triangles, return_inverse=True)
    triangles = numbers.reshape(-1, 3).astype(np.int32)
    try:
        return used, triangles, boundary_loops(triangles)
    except CannotRebuild:
        old, triangles = unpinched(triangles)
        return used[old], triangles, boundary_loops(triangles)


def volumes_of_parts(points: Floats, triangles: Indices) -> tuple[Indices, Floats]:
    """Find the connected parts of a surface that the wall z = 0 closes.

    Args:
        points: `(m, 3)` [m].
        triangles: `(t, 3)`, outward oriented.

    Returns:
        The part of each triangle `(t,)`, from 0 on, and what each part encloses [m^3], cavities less than nothing.
    """
    part = part_of_vertex(triangles, len(points))[triangles[:, 0]]
    volumes = np.zeros(int(part.max()) + 1)
    np.add.at(volumes, part, np.linalg.det(points[triangles]) / 6.0)
    return part, volumes


def largest_part(points: Floats, triangles: Indices) -> Floats:
    """Vertices `(k, 3)` of the part that encloses most; arguments as above."""
    part, volumes = volumes_of_parts(points, triangles)
    return points[np.unique(triangles[part == volumes.argmax()])]


def small_parts(points: Floats, triangles: Indices, least: float) -> tuple[NDArray[np.bool_], float]:
    """Find the parts that enclose less than a volume [m^3]; the largest never is one. Other arguments as above.

    A cavity, which encloses less than nothing, is none.

    Returns:
        Whether each triangle is of such a part `(t,)`, and what these enclose together [m^3].
    """
    part, volumes = volumes_of_parts(points, triangles)
    is_small = (volumes >= 0.0) & (volumes < least)
    is_small[volumes.argmax()] = False
    return is_small[part], float(volumes[is_small].sum())


def are_outside(places: Floats, surface: tuple[Floats, Indices], normals: Floats, distance: float) -> NDArray[np.bool_]:
    """Whether places `(n, 3)` are farther than a distance outside the nearest vertex of a surface `(n,)`; all in m.

    Of those that are far from all vertices it is asked what the surface, closed by the wall below, winds round.

    Args:
        places: to judge.
        surface: vertices `(m, 3)` and triangles `(t, 3)`, whose edges are shorter than three distances.
        normals: outward ones of vertices `(m, 3)`.
        distance: at least a few tenths of an edge, since the nearest vertex stands for the surface.
    """
    points, triangles = surface
    nearest = np.full(len(places), -1)
    _find_nearest(points, places, find_near(points, places, FAR * distance), nearest)
    outside = ((places - points[nearest]) * normals[nearest]).sum(axis=1) > distance
    far = nearest < 0
    if far.any():
        outside[far] = Windings.of(points, triangles, distance).about(places[far]) <= 0
    return outside


@njit(cache=True)
def _find_nearest(points, places, lists, nearest):
    """Write the nearest of the points `(m, 3)` that have each place in their lists; where there is none nothing."""
    (offsets, indices), least = lists, np.full(places.shape[0], inf)
    for v in range(points.shape[0]):
        for k in range(offsets[v], offsets[v + 1]):
            j = indices[k]
            x, y, z = places[j, 0] - points[v, 0], places[j, 1] - points[v, 1], places[j, 2] - points[v, 2]
            square = x * x + y * y + z * z
            if square < least[j]:
                least[j], nearest[j] = square, v
