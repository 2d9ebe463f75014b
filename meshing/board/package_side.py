"""Displaced underside of the package, bilinear between its nodes like its facets."""

from dataclasses import dataclass

import numpy as np

from reflowshock.meshing.board.pads import lift
from reflowshock.meshing.board.parameters import Board, Package, Warpage
from reflowshock.meshing.board.plan import Interval, package_plan

MERGE = 1.0e-9  # m: grid lines at a smaller distance coincide
STEPS = 30  # of the fixed-point iteration, whose error decreases by the strain in each step
EXACT = 1.0e-15  # m


class NotStructuredError(ValueError):
    """Error for nodes that do not form a complete grid in plan, or for a point outside the grid."""


@dataclass(frozen=True, slots=True, eq=False)
class StructuredFace:
    """Bilinear interpolation of values on a rectilinear grid.

    Attributes:
        x: Grid lines, increasing, shape (m,) [m].
        y: Grid lines, increasing, shape (n,) [m].
        values: Values at the nodes, shape (m, n, c).
    """

    x: np.ndarray
    y: np.ndarray
    values: np.ndarray

    @classmethod
    def of_nodes(cls, points: np.ndarray, values: np.ndarray) -> "StructuredFace":
        """Build the grid from its nodes.

        Args:
            points: Nodes in any order, each once, shape (k, 2 or more) [m].
            values: Values at the nodes, shape (k, c).

        Raises:
            NotStructuredError: The nodes do not form a complete grid.
        """
        lines, indices = [], []
        for axis in range(2):
            _, first, index = np.unique(np.round(points[:, axis] / MERGE), return_index=True, return_inverse=True)
            lines.append(points[first, axis])
            indices.append(index)
        shape = len(lines[0]), len(lines[1])
        if len(points) != shape[0] * shape[1] or len(np.unique(indices[0] * shape[1] + indices[1])) != len(points):
            raise NotStructuredError(f"{len(points)} nodes do not form a grid of {shape[0]} x {shape[1]} lines")
        grid = np.empty((*shape, values.shape[1]))
        grid[indices[0], indices[1]] = values
        return cls(lines[0], lines[1], grid)

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the values at points x, y, both (k,) [m], shape (k, c).

        Raises:
            NotStructuredError: A point lies outside the grid.
        """
        (i, s), (j, t) = _cell(self.x, x, "x"), _cell(self.y, y, "y")
        s, t, grid = s[:, None], t[:, None], self.values
        lower = (1.0 - s) * grid[i, j] + s * grid[i + 1, j]
        return (1.0 - t) * lower + t * ((1.0 - s) * grid[i, j + 1] + s * grid[i + 1, j + 1])


def _cell(lines: np.ndarray, positions: np.ndarray, axis: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the cell that contains each position, and the relative position in it (0 to 1)."""
    worst = positions[np.argmax(np.maximum(lines[0] - positions, positions - lines[-1]))]
    if not lines[0] - MERGE <= worst <= lines[-1] + MERGE:
        raise NotStructuredError(f"{axis} = {worst:.6g} m, allowed {lines[0]:.6g} to {lines[-1]:.6g} m")
    cell = np.clip(np.searchsorted(lines, positions, side="right") - 1, 0, len(lines) - 2)
    return cell, np.clip((positions - lines[cell]) / np.diff(lines)[cell], 0.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class PackageSide:
    """Displaced underside of the package, with the node planes of the substrate above it.

    Attributes:
        level: Undisplaced height above the board's top face [m].
        displacement: Displacement of its nodes relative to the board's top face, values of shape (m, n, 3) [m].
        above: Level and displacement of each node plane of the substrate, upwards.
    """

    level: float
    displacement: StructuredFace
    above: tuple[tuple[float, StructuredFace], ...] = ()

    @classmethod
    def of_nodes(cls, points: np.ndarray, displacement: np.ndarray) -> "PackageSide":
        """Build the underside from the nodes of its facets, or from all nodes of the substrate.

        Args:
            points: Undisplaced node coordinates, shape (k, 3) [m].
            displacement: Displacements of the nodes, shape (k, 3) [m].

        Raises:
            NotStructuredError: The nodes of a plane do not form a grid.
        """
        levels, plane = np.unique(np.round(points[:, 2] / MERGE), return_inverse=True)
        planes = [plane == number for number in range(len(levels))]
        faces = [
            (float(points[rows, 2].mean()), StructuredFace.of_nodes(points[rows], displacement[rows]))
            for rows in planes
        ]
        return cls(*faces[0], tuple(faces[1:]))

    @classmethod
    def prescribed(cls, package: Package, board: Board, warpage: Warpage) -> "PackageSide":
        """Build the underside from the plan of the package and a prescribed warpage."""
        plan = package_plan(package, board)
        x, y = _lines(plan.x), _lines(plan.y)
        displacement = np.zeros((len(x), len(y), 3))
        displacement[:, :, 2] = lift(package, warpage, x[:, None], y[None, :])
        face, level, substrate = StructuredFace(x, y, displacement), underside(package), package.substrate
        planes = level + substrate.thickness * np.arange(1, substrate.elements + 1) / substrate.elements
        return cls(level, face, tuple((float(plane), face) for plane in planes))

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height above the board's top face at points x, y, all (k,) [m]; errors as in ``origin``."""
        origin = self.origin(x, y)
        return self.level + self.displacement(origin[:, 0], origin[:, 1])[:, 2]

    def origin(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the undisplaced points, shape (k, 2) [m], of the underside that are displaced to x, y, both (k,) [m].

        The point X is found by the fixed-point iteration X <- (x, y) - u(X), which contracts by the strain.

        Raises:
            NotStructuredError: A point lies beyond the package.
        """
        target = np.column_stack([x, y])
        origin = target
        for _ in range(STEPS):
            moves = self.displacement(origin[:, 0], origin[:, 1])
            before, origin = origin, target - moves[:, :2]
            if np.abs(origin - before).max() < EXACT:
                break
        return origin

    def displaced(self, points: np.ndarray) -> np.ndarray:
        """Return the displaced positions of points (k, 3) [m] of the substrate, interpolated linearly, (k, 3) [m].

        Raises:
            NotStructuredError: A point lies beyond the package.
        """
        faces = ((self.level, self.displacement), *self.above)
        levels = np.array([level for level, _ in faces])
        (layer, share), x, y = _cell(levels, points[:, 2], "z"), points[:, 0], points[:, 1]
        moves = np.array([face(x, y) for _, face in faces])
        each, share = np.arange(len(points)), share[:, None]
        return points + (1.0 - share) * moves[layer, each] + share * moves[layer + 1, each]


def underside(package: Package) -> float:
    """Return the height of the undisplaced package's lowest face above the board's top face [m].

    The face is the underside of the substrate, or of the copper plate below it.

    Args:
        package: Package with its standoff (gap between the pads) and the thickness and kind of its copper.
    """
    return package.standoff + (1 if package.copper.layout == "plate" else 2) * package.copper.thickness


def _lines(axis: tuple[Interval, ...]) -> np.ndarray:
    """Return all grid lines of an axis, each once [m]."""
    return np.concatenate([axis[0].lines(), *(part.lines()[1:] for part in axis[1:])])
