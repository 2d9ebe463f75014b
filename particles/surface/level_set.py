"""Level sets on a grid: signed distance to closed triangulated surfaces, smooth union of liquids, triangulation."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core import winding_numbers
from reflowshock.particles.core.grid import Grid
from reflowshock.particles.surface import near_distance
from reflowshock.particles.surface.surface_quality import flip_to_delaunay, smoothing_offsets

if TYPE_CHECKING:
    import pyvista

# Smoothing passes over the triangles of a new surface.
RELAXATIONS = 30
# The eight corners of a cell.
CORNERS = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class LevelSet:
    """A function on a grid, negative in the liquid.

    Attributes:
        grid: Grid of nodes.
        values: Values at the nodes, shape (i, j, k) [m].
    """

    grid: Grid
    values: Floats

    def at(self, points: Floats, order: int = 3) -> Floats:
        """Return values at points (n, 3) by spline interpolation, shape (n,) [m]; order 1 is trilinear."""
        return map_coordinates(self.values, self.grid.indices(points).T, order=order, mode="nearest")

    def gradient(self, points: Floats, order: int = 3) -> Floats:
        """Return the gradient at points (n, 3) by central differences over a node spacing, shape (n, 3)."""
        reach = 0.5 * self.grid.spacing
        ends = [(self.at(points + step, order), self.at(points - step, order)) for step in reach * np.eye(3)]
        return np.stack([(after - before) / (2.0 * reach) for after, before in ends], axis=1)


def signed_distance(points: Floats, triangles: Indices, grid: Grid) -> LevelSet:
    """Compute the signed distance to a closed surface at the nodes of a grid, negative inside.

    The inside is where the winding number is positive, so folded surfaces are accepted.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3), that share the vertices of their edges.
        grid: Regular grid of nodes: origin, spacing and numbers of nodes.

    Returns:
        Distances at the nodes of the grid, shape (i, j, k) [m].
    """
    import pyvista  # most reflows need no level set, and start without it

    nodes = pyvista.ImageData(dimensions=grid.shape, spacing=(grid.spacing,) * 3, origin=grid.origin)
    distance = _distance(nodes, points, triangles).reshape(grid.shape, order="F")
    return LevelSet(grid, np.where(winding_numbers_on(grid, points, triangles) > 0, -distance, distance))


def signed_distance_in_band(points: Floats, triangles: Indices, grid: Grid, band: float) -> LevelSet:
    """Compute the signed distance to a closed surface at the nodes of a grid, limited in magnitude, negative inside.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3), that share the vertices of their edges.
        grid: Regular grid of nodes: origin, spacing and numbers of nodes.
        band: Largest magnitude [m]; nodes farther from the surface get it with the sign of their side.

    Returns:
        Distances at the nodes of the grid, shape (i, j, k) [m].
    """
    distance = np.full(grid.shape, band)
    near_distance.lower_to_distance(points, triangles, grid.origin, grid.spacing, distance)
    return LevelSet(grid, np.where(winding_numbers_on(grid, points, triangles) > 0, -distance, distance))


def measure_depths(points: Floats, vertices: Floats, triangles: Indices) -> Floats:
    """Return the depths of points inside a closed surface, negative outside, shape (n,) [m].

    Args:
        points: Points, shape (n, 3) [m].
        vertices: Vertices of the surface, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
    """
    import pyvista

    distance = _distance(pyvista.PolyData(points), vertices, triangles)
    return np.where(winding_numbers.at_points(points, vertices[triangles]) > 0.5, distance, -distance)


def _distance(nodes: "pyvista.DataSet", points: Floats, triangles: Indices) -> Floats:
    """Return unsigned distances of nodes to a surface [m]; VTK's sign would be wrong where the surface is folded."""
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(points, triangles)
    return np.abs(nodes.compute_implicit_distance(surface)["implicit_distance"])


def winding_numbers_on(grid: Grid, points: Floats, triangles: Indices) -> Indices:
    """Return the winding numbers of a closed surface at the nodes of a grid, shape (i, j, k): 1 inside, 0 outside.

    Args:
        grid: Regular grid of nodes: origin, spacing and numbers of nodes.
        points: Vertices, shape (n, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
    """
    numbers = np.zeros(grid.shape, np.int32)
    winding_numbers.on_grid(points, np.ascontiguousarray(triangles), grid.origin, grid.spacing, numbers)
    return numbers


def smooth_union(parts: Sequence[LevelSet], reach: float) -> LevelSet:
    """Return the union of liquids on one grid, with a neck wherever a gap is narrower than half the reach.

    It is the polynomial smooth minimum min(a, b) - max(reach - |a - b|, 0)^2 / (4 reach).

    Args:
        parts: Level sets on the same grid, negative in the liquid; not changed.
        reach: Twice the width of the widest gap that is bridged [m].
    """
    values = parts[0].values
    for part in parts[1:]:
        overlap = np.maximum(reach - np.abs(values - part.values), 0.0)
        values = np.minimum(values, part.values) - overlap**2 / (4.0 * reach)
    return LevelSet(parts[0].grid, values)


def extract_surface(level: LevelSet) -> tuple[Floats, Indices]:
    """Triangulate the zero level of a level set, with edges of about the grid's spacing.

    Naive surface nets (Gibson 1998): a vertex in each cell that the surface crosses, at the mean of the crossings of
    its edges; two triangles across each edge of the grid that the surface crosses.

    Args:
        level: Values at the nodes of a grid, negative in the liquid.

    Returns:
        Vertices (n, 3) [m] and outward oriented triangles (t, 3), closed if the liquid is inside the grid.
    """
    inside = level.values < 0.0
    points, number = _cell_vertices(level, inside)
    quads = np.concatenate([_quads(inside, number, axis) for axis in range(3)])
    return points, _split(points, quads)


def smooth_on_level_set(
    level: LevelSet, points: Floats, triangles: Indices, rings: Sequence[Indices]
) -> tuple[Floats, Indices]:
    """Smooth the triangles of a surface: tangential smoothing, projection onto the level set, Delaunay flips.

    Args:
        level: Level set that is zero on the surface, symmetric about the walls.
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        rings: Contact lines as vertices in order, shape (k,) each; each stays in its horizontal wall.

    Returns:
        New vertices (n, 3) [m] and triangles (t, 3).
    """
    heights = [points[ring, 2].mean() for ring in rings]
    for _ in range(RELAXATIONS):
        points = project_onto_level_set(level, points + smoothing_offsets(points, triangles, len(points), rings))
        for ring, height in zip(rings, heights, strict=True):
            points[ring, 2] = height
        triangles, _ = flip_to_delaunay(points, triangles, rings)
    return points, triangles


def project_onto_level_set(level: LevelSet, points: Floats) -> Floats:
    """Move points near the zero level onto it by one Newton step along the gradient.

    Args:
        level: Values at the nodes of a grid [m].
        points: Points, shape (n, 3) [m]; not changed.

    Returns:
        Moved points, shape (n, 3) [m].
    """
    gradient = level.gradient(points)
    return points - (level.at(points) / (gradient**2).sum(axis=1))[:, None] * gradient


def _cell_vertices(level: LevelSet, inside: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.int64]]:
    """Return vertices (n, 3) [m] and the number of each cell's vertex, -1 where the surface does not cross the cell."""
    values = level.values
    shape = tuple(np.array(values.shape) - 1)
    corner = np.stack([values[_shifted(c, shape)] for c in CORNERS], axis=-1)
    signs = np.stack([inside[_shifted(c, shape)] for c in CORNERS], axis=-1)
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
    indices: NDArray[Any] = np.argwhere(active) + total / count[:, None]
    return level.grid.positions(indices), number


def _shifted(corner: NDArray[np.int64], shape: tuple[int, ...]) -> tuple[slice, ...]:
    """Return the slices that select one corner of each cell from the nodes."""
    return tuple(slice(c, c + n) for c, n in zip(corner, shape, strict=True))


def _quads(inside: NDArray[np.bool_], number: NDArray[np.int64], axis: int) -> NDArray[np.int64]:
    """Return the outward oriented quadrilaterals across the crossed grid edges along an axis, shape (q, 4)."""
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
    upper = np.where(first[:, None], np.stack((a, b, c), 1), np.stack((a, b, d), 1))
    lower = np.where(first[:, None], np.stack((a, c, d), 1), np.stack((b, c, d), 1))
    return np.concatenate((upper, lower)).astype(np.int32)
