"""A face of structured quadrilaterals that is a grid in plan: values at its nodes, bilinear between them."""

from dataclasses import dataclass

import numpy as np

MERGE = 1.0e-9  # m: grid lines nearer than this are one


class NotStructuredError(ValueError):
    """Nodes that are no complete grid in plan, or a point outside the grid."""


@dataclass(frozen=True, slots=True, eq=False)
class StructuredFace:
    """Values on a grid.

    Attributes:
        x, y: grid lines (m,), (n,) [m], increasing.
        values: (m, n, c) at the nodes.
    """

    x: np.ndarray
    y: np.ndarray
    values: np.ndarray

    @classmethod
    def of_nodes(cls, points: np.ndarray, values: np.ndarray) -> "StructuredFace":
        """Sort nodes into their grid.

        Args:
            points: (k, 2 or more) [m], in any order, each node once.
            values: (k, c) at the nodes.

        Raises:
            NotStructuredError: the nodes are not all crossings of their lines, each once.
        """
        lines, places = [], []
        for axis in range(2):
            _, first, place = np.unique(np.round(points[:, axis] / MERGE), return_index=True, return_inverse=True)
            lines.append(points[first, axis])
            places.append(place)
        shape = len(lines[0]), len(lines[1])
        if len(points) != shape[0] * shape[1] or len(np.unique(places[0] * shape[1] + places[1])) != len(points):
            raise NotStructuredError(f"{len(points)} nodes are no grid of {shape[0]} x {shape[1]} lines")
        grid = np.empty((*shape, values.shape[1]))
        grid[places[0], places[1]] = values
        return cls(lines[0], lines[1], grid)

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the values at points (k,), (k,) [m]: (k, c).

        Raises:
            NotStructuredError: a point lies outside the grid.
        """
        (i, s), (j, t) = _cell(self.x, x, "x"), _cell(self.y, y, "y")
        s, t, grid = s[:, None], t[:, None], self.values
        lower = (1.0 - s) * grid[i, j] + s * grid[i + 1, j]
        return (1.0 - t) * lower + t * ((1.0 - s) * grid[i, j + 1] + s * grid[i + 1, j + 1])


def _cell(lines: np.ndarray, places: np.ndarray, axis: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the cell in which each place lies, and where in it (0 to 1)."""
    worst = places[np.argmax(np.maximum(lines[0] - places, places - lines[-1]))]
    if not lines[0] - MERGE <= worst <= lines[-1] + MERGE:
        raise NotStructuredError(f"{axis} = {worst:.6g} m, allowed {lines[0]:.6g} to {lines[-1]:.6g} m")
    cell = np.clip(np.searchsorted(lines, places, side="right") - 1, 0, len(lines) - 2)
    return cell, np.clip((places - lines[cell]) / np.diff(lines)[cell], 0.0, 1.0)
