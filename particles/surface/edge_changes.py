"""Edge splits and edge collapses on a triangulated surface that stretches or shrinks.

Each new vertex is the mean of two old ones, so any field on the vertices can be transferred. A split does not change
the shape. A collapse is left out if it would fold the surface or pinch it off (link condition); if one end of the edge
is on a contact line, the merged vertex stays on the line. A corner of three triangles whose base has a short edge is
cut off, since the base, a closed loop, could not collapse.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices

# Cosine of the largest angle by which a collapse may turn a triangle.
TURNED = 0.3


@dataclass(frozen=True, slots=True)
class NewSurface:
    """Changed triangulation with k vertices.

    Attributes:
        first: First of the two old vertices whose mean each new vertex is, shape (k,).
        second: Second of them, shape (k,); equal to the first if the vertex did not change.
        triangles: Triangles, shape (t, 3).
        rings: Contact lines.
    """

    first: Indices
    second: Indices
    triangles: Indices
    rings: tuple[Indices, ...]


@njit(cache=True)
def extreme_edges(points, triangles):
    """Return the lengths of the shortest and of the longest edge of a triangulation, a tuple of two scalars [m].

    No argument is changed.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3); inf and 0 are returned without any.
    """
    shortest, longest = np.inf, 0.0
    for a, b, c in triangles:
        for i, j in ((a, b), (b, c), (c, a)):
            x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
            square = x * x + y * y + z * z
            shortest, longest = min(shortest, square), max(longest, square)
    return np.sqrt(shortest), np.sqrt(longest)


@dataclass(frozen=True, slots=True)
class VertexFaces:
    """Triangles around each vertex of a triangulation.

    Attributes:
        triangles: Triangles, shape (t, 3).
        faces: Numbers of the triangles around one vertex after the other, ascending for each vertex, shape (3 t,).
        ends: End of each vertex's triangles among them, shape (n,).
    """

    triangles: Indices
    faces: Indices
    ends: Indices

    @classmethod
    def of(cls, triangles: Indices, count: int) -> "VertexFaces":
        """Sort triangles (t, 3) by their vertices, of which there are ``count``."""
        order = np.argsort(triangles.ravel(), kind="stable")
        return cls(triangles, order // 3, np.cumsum(np.bincount(triangles.ravel(), minlength=count)))

    def __getitem__(self, vertex: int) -> Indices:
        """Return the numbers of the triangles around a vertex."""
        return self.faces[self.ends[vertex - 1] if vertex else 0 : self.ends[vertex]]


def split_long(
    points: Floats, triangles: Indices, rings: Sequence[Indices], longest: float, on_rings: bool
) -> NewSurface:
    """Split edges longer than a length, the longest first, at most one edge of each triangle.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        rings: Contact lines as vertices in order, shape (k,) each; may be empty.
        longest: Length beyond which an edge is split [m].
        on_rings: Whether edges of contact lines are split, too.

    Returns:
        New triangulation: triangles, contact lines, and the two old vertices whose mean each new vertex is.
    """
    edges, sides = _edges(triangles)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    busy = np.zeros(len(triangles), bool)
    pairs: list[Indices] = []
    faces = list(triangles)
    lines = [ring.tolist() for ring in rings]
    for edge in np.argsort(-length, kind="stable"):
        if length[edge] <= longest:
            break
        around = sides[edge][sides[edge] >= 0]
        if busy[around].any() or (len(around) == 1 and not on_rings):
            continue
        busy[around] = True
        new, (i, j) = len(points) + len(pairs), edges[edge]
        pairs.append(edges[edge])
        for face in around:
            old = faces[face]
            faces[face] = np.where(old == i, new, old)
            faces.append(np.where(old == j, new, old))
        if len(around) == 1:
            _insert(lines, int(i), int(j), new)
    unchanged = np.arange(len(points), dtype=np.int32)
    ends = np.array(pairs, np.int32).reshape(-1, 2)
    first, second = np.concatenate((unchanged, ends[:, 0])), np.concatenate((unchanged, ends[:, 1]))
    rows = tuple(np.array(line, np.int32) for line in lines)
    return NewSurface(first, second, np.array(faces, np.int32), rows)


def collapse_short(
    points: Floats, triangles: Indices, rings: Sequence[Indices], shortest: float, on_rings: bool
) -> NewSurface:
    """Collapse edges shorter than a length, the shortest first, at most one edge around each vertex.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        rings: Contact lines as vertices in order, shape (k,) each; may be empty.
        shortest: Length below which an edge collapses [m].
        on_rings: Whether edges of contact lines collapse, too.

    Returns:
        New triangulation: triangles, contact lines, and the two old vertices whose mean each new vertex is.
    """
    edges, sides = _edges(triangles)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    on_ring = np.zeros(len(points), bool)
    for ring in rings:
        on_ring[ring] = True
    faces_of = VertexFaces.of(triangles, len(points))
    first, second = (np.arange(len(points), dtype=np.int32) for _ in range(2))
    target, busy = np.arange(len(points), dtype=np.int32), np.zeros(len(points), bool)
    for edge in np.argsort(length, kind="stable"):
        if length[edge] >= shortest:
            break
        remaining, removed = (int(end) for end in edges[edge])
        tip = _tip(faces_of, remaining, removed)
        if tip is not None:
            removed = tip
        elif on_ring[removed]:
            remaining, removed = removed, remaining
        is_boundary = (sides[edge] < 0).any()
        if on_ring[removed] and not (is_boundary and on_rings):
            continue
        near = triangles[np.concatenate((faces_of[remaining], faces_of[removed]))]
        stays_fixed = tip is not None or (on_ring[remaining] and not on_ring[removed])
        merged = points[remaining] if stays_fixed else 0.5 * (points[remaining] + points[removed])
        if busy[near].any() or (tip is None and not _may_collapse(points, faces_of, remaining, removed, merged)):
            continue
        busy[near] = True
        target[removed] = remaining
        if not stays_fixed:
            second[remaining] = removed
    faces = target[triangles]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    stays = target == np.arange(len(points))
    number = (np.cumsum(stays) - 1).astype(np.int32)
    lines = tuple(number[ring[stays[ring]]] for ring in rings)
    return NewSurface(first[stays], second[stays], number[faces], lines)


def _tip(faces_of: VertexFaces, i: int, j: int) -> int | None:
    """Return the vertex opposite to the edge i-j in which exactly three triangles meet, else None.

    The base of these three triangles must not be a triangle of the surface.
    """
    triangles, ends = faces_of.triangles, {i, j}
    shared = set(faces_of[i]) & set(faces_of[j])
    opposite = set(triangles[list(shared)].ravel().tolist()) - ends
    for vertex in opposite:
        around = set(triangles[faces_of[vertex]].ravel().tolist()) - {vertex}
        if len(faces_of[vertex]) == len(around) == 3 and not around <= opposite | ends:
            return int(vertex)
    return None


def _may_collapse(points: Floats, faces_of: VertexFaces, i: int, j: int, merged: Floats) -> bool:
    """Return whether merging the vertices i and j in a point (3,) neither folds the surface nor pinches it off."""
    triangles, ends = faces_of.triangles, (i, j)
    rings = [set(triangles[faces_of[end]].ravel().tolist()) - {i, j} for end in ends]
    shared = set(faces_of[i]) & set(faces_of[j])
    if len(rings[0] & rings[1]) != len(shared):
        return False
    for face in set(faces_of[i]) ^ set(faces_of[j]):
        corners = points[triangles[face]]
        moved = np.where(np.isin(triangles[face], ends)[:, None], merged, corners)
        before, after = (np.cross(c[1] - c[0], c[2] - c[0]) for c in (corners, moved))
        if before @ after < TURNED * np.linalg.norm(before) * np.linalg.norm(after):
            return False
    return True


def _edges(triangles: Indices) -> tuple[Indices, NDArray[np.int64]]:
    """Return edges (e, 2), the smaller vertex first, and the triangles on both sides (e, 2), -1 at a boundary."""
    half = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    owner = np.tile(np.arange(len(triangles)), 3)
    lower, upper = half.min(axis=1).astype(np.int64), half.max(axis=1)
    key = lower * (int(triangles.max()) + 1) + upper
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    sides = np.full((len(starts), 2), -1)
    sides[:, 0] = owner[order[starts]]
    double = np.diff(np.append(starts, len(order))) == 2
    sides[double, 1] = owner[order[starts[double] + 1]]
    first = order[starts]
    return np.column_stack((lower[first], upper[first])).astype(np.int32), sides


def _insert(lines: list[list[int]], i: int, j: int, new: int) -> None:
    """Insert a vertex between two neighbours of a contact line."""
    for line in lines:
        for position, vertex in enumerate(line):
            if {vertex, line[position - 1]} == {i, j}:
                line.insert(position, new)
                return
