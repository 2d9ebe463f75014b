"""Background grid: a regular grid of nodes with one spacing, for level sets and for fields carried by particles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats


@dataclass(frozen=True, slots=True)
class Grid:
    """A regular grid of nodes; node (i, j, k) is at ``origin + spacing * (i, j, k)``.

    Attributes:
        origin: Position of node (0, 0, 0), shape (3,) [m].
        spacing: Distance between neighbouring nodes [m].
        shape: Number of nodes along x, y and z.
    """

    origin: Floats
    spacing: float
    shape: tuple[int, int, int]

    @classmethod
    def around(cls, points: Floats, spacing: float, walls: Sequence[float] = (0.0,)) -> "Grid":
        """Cover points with a margin of at least two nodes on each side.

        Horizontal walls lie midway between two layers of nodes, so the triangulated zero level of a function that is
        symmetric about a wall has vertices in the wall.

        Args:
            points: Points to cover, shape (n, 3) [m].
            spacing: Distance between nodes [m]; between two walls the nearest one that divides their distance is taken.
            walls: Heights of one or two horizontal walls [m].
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
        """Return the coordinates of the nodes along x, y and z, shapes (i,), (j,), (k,) [m]."""
        return [start + self.spacing * np.arange(count) for start, count in zip(self.origin, self.shape, strict=True)]

    def indices(self, points: Floats) -> Floats:
        """Return fractional node indices of points (n, 3) [m], shape (n, 3); whole numbers at nodes."""
        return (points - self.origin) / self.spacing

    def positions(self, indices: Floats) -> Floats:
        """Return the positions of fractional node indices (n, 3), shape (n, 3) [m]; the inverse of ``indices``."""
        return self.origin + self.spacing * indices

    def part_around(self, points: Floats, margin: int) -> tuple["Grid", tuple[slice, slice, slice]]:
        """Return the part of the grid that covers points with a margin of nodes, as far as the grid extends.

        Args:
            points: Points to cover, shape (n, 3) [m].
            margin: Number of nodes around the points.

        Returns:
            The part as a grid, and the slices that select its nodes from an array of this grid's shape.
        """
        low = np.maximum(np.floor(self.indices(points.min(axis=0))).astype(int) - margin, 0)
        high = np.minimum(np.ceil(self.indices(points.max(axis=0))).astype(int) + margin + 1, self.shape)
        x, y, z = (int(count) for count in high - low)
        part = Grid(self.origin + self.spacing * low, self.spacing, (x, y, z))
        return part, (slice(low[0], high[0]), slice(low[1], high[1]), slice(low[2], high[2]))
