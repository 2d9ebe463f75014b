"""Gaps in a liquid's surface, and the surface that closes them: liquids that meet become one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.sparse import coo_array, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.surface.level_set import LevelSet, extract_surface, within_band

BLUNTINGS = 4
# In nodes: how far about a surface without gaps distances are told; farther ones do not bend splines at it.
BAND = 5
# Cosine of the angle between the normals of vertices that face each other, at most.
FACING = -0.5


@dataclass(frozen=True, slots=True)
class Meeting:
    """Liquids that merged or parted: the step, parts of the surface before and after, change of surface energy [J]."""

    step: int
    before: int
    after: int
    energy: float


def narrowest_gap(points: Floats, triangles: Indices, normals: Floats, gap: float, aside: float) -> float:
    """Return the narrowest gap outside a surface between vertices that face each other [m]; inf where none is found.

    A vertex does not face the neighbours of its neighbours: a notch that narrow is a bend of the surface, not a gap.

    Args:
        points: `(m, 3)` [m].
        triangles: `(t, 3)`.
        normals: `(m, 3)`, outward.
        gap: only narrower ones are looked for [m].
        aside: how far beside the mean normal of two vertices they may be [m].
    """
    first, second = cKDTree(points).query_pairs(float(np.hypot(gap, aside)), output_type="ndarray").T
    facing = (normals[first] * normals[second]).sum(axis=1) < FACING
    first, second = first[facing], second[facing]
    near = _share_a_neighbour(triangles, len(points), first, second)
    first, second = first[~near], second[~near]
    normal = normals[first] - normals[second]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    between = points[second] - points[first]
    height = (between * normal).sum(axis=1)
    beside = np.linalg.norm(between - height[:, None] * normal, axis=1)
    return float(height[(height > 0.0) & (height < gap) & (beside < aside)].min(initial=np.inf))


def _share_a_neighbour(triangles: Indices, count: int, first: Indices, second: Indices) -> NDArray[np.bool_]:
    """Whether the vertices of each pair `(k,)` are joined by one edge or two."""
    ends = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    edges = coo_array((np.ones(len(ends), np.int32), ends.T), shape=(count, count)).tocsr()
    around = edges + edges.T + eye_array(count, dtype=np.int32, format="csr")
    return np.asarray(around[first].multiply(around[second]).sum(axis=1)).ravel() > 0


def closed_level(level: LevelSet, gap: float) -> LevelSet:
    """Return a level set whose gaps narrower than ``gap`` [m] are filled; if negative, without what is thinner.

    What is within half of it is added, and what is then within half of it of the outside is taken away again; or first
    taken away, and then added.
    """
    grid = level.grid
    surface, band = extract_surface(LevelSet(grid, level.values - 0.5 * gap)), 0.5 * abs(gap) + BAND * grid.spacing
    wider = within_band(*surface, grid, band)
    least = np.minimum if gap > 0.0 else np.maximum
    return LevelSet(grid, least(level.values, wider.values + 0.5 * gap))


def without_slits(level: LevelSet) -> LevelSet:
    """Return a level set whose net is a surface: slits and grooves narrower than its cells are blunted.

    Two sheets that cross the same cells share vertices and edges there. A Gaussian as wide as a cell parts or closes
    them; where there are none nothing changes.
    """
    for _ in range(BLUNTINGS):
        edges = np.sort(np.concatenate([extract_surface(level)[1][:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
        if np.unique(edges, axis=0, return_counts=True)[1].max(initial=0) <= 2:
            break
        level = LevelSet(level.grid, gaussian_filter(level.values, 1.0))
    return level


def part_of_vertex(triangles: Indices, count: int) -> Indices:
    """Return to which connected part of a surface each of its vertices `(count,)` belongs, from 0 on."""
    return groups(triangles.ravel(), np.roll(triangles, 1, axis=1).ravel(), count)


def groups(first: Indices, second: Indices, count: int) -> Indices:
    """Return to which group each of ``count`` things belongs, from 0 on, where the pairs of two lists hang together."""
    graph = coo_array((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def parts_of(triangles: Indices) -> int:
    """Number of connected parts of a surface whose vertices all have triangles."""
    return int(part_of_vertex(triangles, int(triangles.max()) + 1).max()) + 1
