"""Triangles of a level set: a net with one vertex a cell, relaxed on the surface until its triangles are even."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.surface.level_set import LevelSet
from reflowshock.particles.surface.surface_quality import flip_to_delaunay, smoothing_offsets

RELAXATIONS = 30
CORNERS = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)


def extract_surface(level: LevelSet) -> tuple[Floats, Indices]:
    """Triangulate the surface on which a level set is zero, with edges of about the grid's spacing.

    Naive surface nets (Gibson 1998): a vertex in each cell that the surface crosses, at the mean of the crossings of
    its edges; two triangles across each edge of the grid that the surface crosses.

    Returns:
        Points `(n, 3)` [m] and triangles `(t, 3)`, outward oriented, closed if the liquid is inside the grid.
    """
    inside = level.values < 0.0
    points, number = _cell_vertices(level, inside)
    quads = np.concatenate([_quads(inside, number, axis) for axis in range(3)])
    return points, _split(points, quads)


def relax(level: LevelSet, points: Floats, triangles: Indices, rings: Sequence[Indices]) -> tuple[Floats, Indices]:
    """Even out the triangles of a surface: tangential smoothing, projection onto the level set, Delaunay flips.

    Args:
        level: level set that is zero on the surface, symmetric about the walls.
        points: `(n, 3)` [m].
        triangles: `(t, 3)`.
        rings: contact lines, each in a horizontal wall, in which it stays.
    """
    heights = [points[ring, 2].mean() for ring in rings]
    for _ in range(RELAXATIONS):
        points = project(level, points + smoothing_offsets(points, triangles, len(points), rings))
        for ring, height in zip(rings, heights, strict=True):
            points[ring, 2] = height
        triangles, _ = flip_to_delaunay(points, triangles, rings)
    return points, triangles


def project(level: LevelSet, points: Floats) -> Floats:
    """Move points near a surface onto it by one Newton step along the gradient, `(n, 3)` [m]."""
    gradient = level.gradient(points)
    return points - (level.at(points) / (gradient**2).sum(axis=1))[:, None] * gradient


def _cell_vertices(level: LevelSet, inside: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.int64]]:
    """Vertices `(n, 3)` [m] and the number of each cell's vertex, -1 where the surface does not cross the cell."""
    values = level.values
    shape = tuple(np.array(values.shape) - 1)
    corner = np.stack([values[_from(c, shape)] for c in CORNERS], axis=-1)
    signs = np.stack([inside[_from(c, shape)] for c in CORNERS], axis=-1)
    active = signs.any(axis=-1) & ~signs.all(axis=-1)
    number = np.full(shape, -1, np.int64)
    number[active] = np.arange(active.sum())
    corner, signs = corner[active], signs[active]
    total, count = np.zeros((len(corner), 3)), np.zeros(len(corner))
    for first, last in ((a, b) for a in range(8) for b in range(a) if np.abs(CORNERS[a] - CORNERS[b]).sum() == 1):
        cut = signs[:, first] != signs[:, last]
        part = corner[cut, first] / (corner[cut, first] - corner[cut, last])
        total[cut] += CORNERS[first] + part[:, None] * (CORNERS[last] - CORNERS[first])
        count[cut] += 1.0
    cells = np.argwhere(active)
    return level.grid.origin + level.grid.spacing * (cells + total / count[:, None]), number


def _from(corner: NDArray[np.int64], shape: tuple[int, ...]) -> tuple[slice, ...]:
    return tuple(slice(c, c + n) for c, n in zip(corner, shape, strict=True))


def _quads(inside: NDArray[np.bool_], number: NDArray[np.int64], axis: int) -> NDArray[np.int64]:
    """Quadrilaterals across the crossed grid edges along an axis, outward oriented, `(q, 4)`."""
    inside, number = np.moveaxis(inside, axis, 0), np.moveaxis(number, axis, 0)
    low, high = inside[:-1, 1:-1, 1:-1], inside[1:, 1:-1, 1:-1]
    around = np.stack((number[:, :-1, :-1], number[:, 1:, :-1], number[:, 1:, 1:], number[:, :-1, 1:]), axis=-1)
    out, back = around[low & ~high], around[high & ~low][:, ::-1]
    quads = np.concatenate((out, back))
    return quads if axis != 1 else quads[:, ::-1]


def _split(points: Floats, quads: NDArray[np.int64]) -> Indices:
    """Split quadrilaterals along their shorter diagonal."""
    a, b, c, d = quads.T
    first = np.linalg.norm(points[a] - points[c], axis=1) < np.linalg.norm(points[b] - points[d], axis=1)
    one = np.where(first[:, None], np.stack((a, b, c), 1), np.stack((a, b, d), 1))
    two = np.where(first[:, None], np.stack((a, c, d), 1), np.stack((b, c, d), 1))
    return np.concatenate((one, two)).astype(np.int32)
