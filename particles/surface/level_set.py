"""Signed distance to closed triangle surfaces on a grid, and the smooth union of two liquids."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyvista
from scipy.ndimage import map_coordinates

from reflowshock.arrays import Floats, Indices


@dataclass(frozen=True, slots=True)
class Grid:
    """A regular grid.

    Attributes:
        origin: `(3,)` of the first node [m].
        spacing: of the nodes [m].
        counts: nodes along each axis.
    """

    origin: Floats
    spacing: float
    counts: tuple[int, int, int]

    @classmethod
    def around(cls, points: Floats, spacing: float, walls: Sequence[float] = (0.0,)) -> "Grid":
        """Cover points `(n, 3)` with two nodes to spare.

        Walls lie midway between nodes: the net of a surface that is symmetric about one has vertices in it.

        Args:
            points: what to cover [m].
            spacing: of the nodes [m]; between two walls the nearest one that divides their distance.
            walls: heights of one or two horizontal walls [m].
        """
        if len(walls) == 2:
            gap = walls[1] - walls[0]
            spacing = gap / round(gap / spacing)
        datum = np.array([0.0, 0.0, walls[0]])
        first = np.floor((points.min(axis=0) - datum) / spacing) - 2.0
        last = np.ceil((points.max(axis=0) - datum) / spacing) + 2.0 + np.array([0.0, 0.0, 1.0])
        x, y, z = (last - first).astype(int) + 1
        return cls(datum + (first - np.array([0.0, 0.0, 0.5])) * spacing, spacing, (int(x), int(y), int(z)))

    def axes(self) -> list[Floats]:
        """Coordinates of the nodes along each axis [m]."""
        return [start + self.spacing * np.arange(count) for start, count in zip(self.origin, self.counts, strict=True)]


@dataclass(frozen=True, slots=True)
class LevelSet:
    """A function on a grid, negative in the liquid.

    Attributes:
        grid: the grid.
        values: `(i, j, k)` at the nodes [m].
    """

    grid: Grid
    values: Floats

    def at(self, points: Floats) -> Floats:
        """Values at points `(n, 3)` by cubic splines, `(n,)` [m]."""
        place = ((points - self.grid.origin) / self.grid.spacing).T
        return map_coordinates(self.values, place, order=3, mode="nearest")

    def gradient(self, points: Floats) -> Floats:
        """Gradient at points, by central differences over a node spacing, `(n, 3)`."""
        reach = 0.5 * self.grid.spacing
        steps = reach * np.eye(3)
        return np.stack([(self.at(points + step) - self.at(points - step)) / (2.0 * reach) for step in steps], axis=1)


def signed_distance(points: Floats, triangles: Indices, grid: Grid) -> LevelSet:
    """Signed distance to a closed, outward oriented surface.

    Args:
        points: `(n, 3)` [m].
        triangles: `(t, 3)`; where the surface has an edge, the triangles share its vertices.
        grid: where to evaluate it.
    """
    nodes = pyvista.ImageData(dimensions=grid.counts, spacing=(grid.spacing,) * 3, origin=grid.origin)
    surface = pyvista.PolyData.from_regular_faces(points, triangles)
    values = nodes.compute_implicit_distance(surface)["implicit_distance"]
    return LevelSet(grid, np.asarray(values).reshape(grid.counts, order="F"))


def depths(points: Floats, surface: tuple[Floats, Indices]) -> Floats:
    """How deep points `(n, 3)` are inside a closed surface, negative outside, `(n,)` [m]; arguments as above."""
    closed = pyvista.PolyData.from_regular_faces(*surface)
    return -np.asarray(pyvista.PolyData(points).compute_implicit_distance(closed)["implicit_distance"])


def smooth_union(parts: Sequence[LevelSet], reach: float) -> LevelSet:
    """Union of liquids on one grid, with a neck wherever a gap is narrower than half the reach [m].

    The polynomial smooth minimum: min(a, b) - max(reach - |a - b|, 0)^2 / (4 reach).
    """
    values = parts[0].values
    for part in parts[1:]:
        overlap = np.maximum(reach - np.abs(values - part.values), 0.0)
        values = np.minimum(values, part.values) - overlap**2 / (4.0 * reach)
    return LevelSet(parts[0].grid, values)
