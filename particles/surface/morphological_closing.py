"""Morphological closing of narrow gaps between liquid surfaces, by which liquids merge; connected parts of a surface.

Closing dilates a liquid by half the width of the gap and then erodes it by the same amount; opening erodes first, which
removes thin liquid. Both are offsets of the signed distance.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.sparse import coo_array, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.surface.level_set import LevelSet, extract_surface, signed_distance_in_band

# Largest number of times a level set is smoothed to widen slits.
SMOOTHINGS = 4
# Half width of the band of exact distances in nodes; nodes farther away do not affect splines at the surface.
BAND = 5
# Largest cosine of the angle between the normals of two vertices that face each other.
FACING = -0.5


@dataclass(frozen=True, slots=True)
class TopologyChange:
    """Merged or separated liquids.

    Attributes:
        step: Number of the time step.
        before: Connected parts of the surface before the change.
        after: Connected parts after it.
        energy: Change of the surface energy [J].
    """

    step: int
    before: int
    after: int
    energy: float


def narrowest_gap(points: Floats, triangles: Indices, normals: Floats, gap: float, aside: float) -> float:
    """Return the narrowest gap outside a surface between vertices that face each other [m]; inf without any.

    Vertices with a common neighbour do not count: between them the surface is bent, but has no gap.

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Triangles, shape (t, 3).
        normals: Outward unit normals, shape (m, 3).
        gap: Width below which gaps are searched for [m].
        aside: Largest offset of two vertices across their mean normal [m].
    """
    first, second = cKDTree(points).query_pairs(float(np.hypot(gap, aside)), output_type="ndarray").T
    facing = (normals[first] * normals[second]).sum(axis=1) < FACING
    first, second = first[facing], second[facing]
    connected = _share_a_neighbour(triangles, len(points), first, second)
    first, second = first[~connected], second[~connected]
    normal = normals[first] - normals[second]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    between = points[second] - points[first]
    height = (between * normal).sum(axis=1)
    offset = np.linalg.norm(between - height[:, None] * normal, axis=1)
    return float(height[(height > 0.0) & (height < gap) & (offset < aside)].min(initial=np.inf))


def _share_a_neighbour(triangles: Indices, count: int, first: Indices, second: Indices) -> NDArray[np.bool_]:
    """Return whether the two vertices of each pair are connected by one or two edges, shape (k,)."""
    ends = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    edges = coo_array((np.ones(len(ends), np.int32), ends.T), shape=(count, count)).tocsr()
    around = edges + edges.T + eye_array(count, dtype=np.int32, format="csr")
    return np.asarray(around[first].multiply(around[second]).sum(axis=1)).ravel() > 0


def close_gaps(level: LevelSet, gap: float) -> LevelSet:
    """Return a level set whose gaps narrower than ``gap`` [m] are filled (morphological closing).

    For a negative ``gap`` liquid that is thinner than its magnitude is removed (morphological opening).

    Args:
        level: Values at the nodes of a grid, negative in the liquid; not changed.
        gap: Width [m].
    """
    grid = level.grid
    surface, band = extract_surface(LevelSet(grid, level.values - 0.5 * gap)), 0.5 * abs(gap) + BAND * grid.spacing
    dilated = signed_distance_in_band(*surface, grid, band)
    combine = np.minimum if gap > 0.0 else np.maximum
    return LevelSet(grid, combine(level.values, dilated.values + 0.5 * gap))


def smooth_slits(level: LevelSet) -> LevelSet:
    """Smooth a level set until its triangulation is a manifold, a few times at most: narrow slits open or close.

    Two sheets that cross the same cells share vertices and edges there. A Gaussian of the width of a cell, applied to
    the whole level set, separates or closes them; a level set without slits is returned unchanged.

    Args:
        level: Values at the nodes of a grid, negative in the liquid; not changed.
    """
    for _ in range(SMOOTHINGS):
        edges = np.sort(np.concatenate([extract_surface(level)[1][:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
        if np.unique(edges, axis=0, return_counts=True)[1].max(initial=0) <= 2:
            break
        level = LevelSet(level.grid, gaussian_filter(level.values, 1.0))
    return level


def part_of_vertex(triangles: Indices, count: int) -> Indices:
    """Return the number of the connected part of a surface that each vertex belongs to, from 0, shape (count,).

    Args:
        triangles: Triangles, shape (t, 3).
        count: Number of vertices; each vertex without triangles is a part of its own.
    """
    return connected_groups(triangles.ravel(), np.roll(triangles, 1, axis=1).ravel(), count)


def connected_groups(first: Indices, second: Indices, count: int) -> Indices:
    """Return the number of the connected group of each item, counted from 0, shape (count,).

    Args:
        first: First item of each connected pair, shape (k,).
        second: Second item of each pair, shape (k,).
        count: Number of items, those without pairs included.
    """
    graph = coo_array((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def count_parts(triangles: Indices) -> int:
    """Return the number of connected parts of a surface, given by its triangles (t, 3); every vertex must have one."""
    return int(part_of_vertex(triangles, int(triangles.max()) + 1).max()) + 1
