"""Triangulated surfaces that stretch or shrink: long edges are split in the middle, short ones collapse.

Both are written as means of two old vertices, so that any field of the vertices comes along. A split changes no shape.
A collapse is left out where it would fold the surface or pinch it off (the link condition), and what is left of the
edge stays on a contact line that one of its ends is on. Contact lines themselves are changed where they may be.
A corner of three triangles whose base has a short edge is cut off: the base could not collapse, since it closes a loop.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices

# Cosine of the angle that a collapse may turn a triangle by.
TURNED = 0.3


@dataclass(frozen=True, slots=True)
class NewSurface:
    """A changed triangulation; k vertices.

    Attributes:
        first, second: `(k,)` old vertices whose mean each one is; equal where it was kept.
        triangles: `(t, 3)`.
        rings: contact lines.
    """

    first: Indices
    second: Indices
    triangles: Indices
    rings: tuple[Indices, ...]


@njit(cache=True)
def extreme_edges(points, triangles):
    """Lengths of the shortest and the longest edge of triangles `(t, 3)` [m]."""
    shortest, longest = np.inf, 0.0
    for a, b, c in triangles:
        for i, j in ((a, b), (b, c), (c, a)):
            x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
            square = x * x + y * y + z * z
            shortest, longest = min(shortest, square), max(longest, square)
    return np.sqrt(shortest), np.sqrt(longest)


@dataclass(frozen=True, slots=True)
class FacesOf:
    """The triangles around each vertex, ascending, cut out where they are asked for: few of them are.

    Attributes:
        faces: around one vertex after the other.
        ends: of those of each vertex.
    """

    faces: Indices
    ends: Indices

    @classmethod
    def of(cls, triangles: Indices, count: int) -> "FacesOf":
        """Find those of so many vertices."""
        order = np.argsort(triangles.ravel(), kind="stable")
        return cls(order // 3, np.cumsum(np.bincount(triangles.ravel(), minlength=count)))

    def __getitem__(self, vertex: int) -> Indices:
        """Those around a vertex."""
        return self.faces[self.ends[vertex - 1] if vertex else 0 : self.ends[vertex]]


def split_long(
    points: Floats, triangles: Indices, rings: Sequence[Indices], longest: float, on_rings: bool
) -> NewSurface:
    """Split edges longer than a length [m], the longest first, at most one of a triangle.

    Args:
        points: `(k, 3)` vertices [m].
        triangles: `(t, 3)`.
        rings: contact lines.
        longest: [m].
        on_rings: whether edges of contact lines are split, too.
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
    kept = np.arange(len(points), dtype=np.int32)
    ends = np.array(pairs, np.int32).reshape(-1, 2)
    first, second = np.concatenate((kept, ends[:, 0])), np.concatenate((kept, ends[:, 1]))
    rows = tuple(np.array(line, np.int32) for line in lines)
    return NewSurface(first, second, np.array(faces, np.int32), rows)


def collapse_short(
    points: Floats, triangles: Indices, rings: Sequence[Indices], shortest: float, on_rings: bool
) -> NewSurface:
    """Collapse edges shorter than a length [m], the shortest first, at most one around a vertex.

    Args: as `split_long`.
    """
    edges, sides = _edges(triangles)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    on_ring = np.zeros(len(points), bool)
    for ring in rings:
        on_ring[ring] = True
    faces_of = FacesOf.of(triangles, len(points))
    first, second = (np.arange(len(points), dtype=np.int32) for _ in range(2))
    target, busy = np.arange(len(points), dtype=np.int32), np.zeros(len(points), bool)
    for edge in np.argsort(length, kind="stable"):
        if length[edge] >= shortest:
            break
        kept, gone = (int(end) for end in edges[edge])
        tip = _tip(triangles, faces_of, (kept, gone))
        if tip is not None:
            gone = tip
        elif on_ring[gone]:
            kept, gone = gone, kept
        outer = (sides[edge] < 0).any()
        if on_ring[gone] and not (outer and on_rings):
            continue
        near = triangles[np.concatenate((faces_of[kept], faces_of[gone]))]
        in_place = tip is not None or (on_ring[kept] and not on_ring[gone])
        place = points[kept] if in_place else 0.5 * (points[kept] + points[gone])
        if busy[near].any() or (tip is None and not _may_collapse(points, triangles, faces_of, (kept, gone), place)):
            continue
        busy[near] = True
        target[gone] = kept
        if not in_place:
            second[kept] = gone
    faces = target[triangles]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    stays = target == np.arange(len(points))
    number = (np.cumsum(stays) - 1).astype(np.int32)
    lines = tuple(number[ring[stays[ring]]] for ring in rings)
    return NewSurface(first[stays], second[stays], number[faces], lines)


def _tip(triangles: Indices, faces_of: FacesOf, ends: tuple[int, int]) -> int | None:
    """The vertex over an edge in which three triangles alone meet, on a base that is no triangle yet; else None."""
    shared = set(faces_of[ends[0]]) & set(faces_of[ends[1]])
    over = set(triangles[list(shared)].ravel().tolist()) - set(ends)
    for vertex in over:
        around = set(triangles[faces_of[vertex]].ravel().tolist()) - {vertex}
        if len(faces_of[vertex]) == len(around) == 3 and not around <= over | set(ends):
            return int(vertex)
    return None


def _may_collapse(points: Floats, triangles: Indices, faces_of: FacesOf, ends: tuple[int, int], place: Floats) -> bool:
    """Whether the ends of an edge, joined at a place `(3,)`, leave a surface that is neither folded nor pinched off."""
    kept, gone = ends
    rings = [set(triangles[faces_of[end]].ravel().tolist()) - {kept, gone} for end in ends]
    shared = set(faces_of[kept]) & set(faces_of[gone])
    if len(rings[0] & rings[1]) != len(shared):
        return False
    for face in set(faces_of[kept]) ^ set(faces_of[gone]):
        corners = points[triangles[face]]
        moved = np.where(np.isin(triangles[face], ends)[:, None], place, corners)
        before, after = (np.cross(c[1] - c[0], c[2] - c[0]) for c in (corners, moved))
        if before @ after < TURNED * np.linalg.norm(before) * np.linalg.norm(after):
            return False
    return True


def _edges(triangles: Indices) -> tuple[Indices, NDArray[np.int64]]:
    """Edges `(e, 2)`, the smaller vertex first, and the triangles on both sides `(e, 2)`, -1 where there is none."""
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
    """Put a vertex between two neighbours of a contact line."""
    for line in lines:
        for place, vertex in enumerate(line):
            if {vertex, line[place - 1]} == {i, j}:
                line.insert(place, new)
                return
