"""The package's underside where the shock has it: displaced, and bilinear between its nodes as its facets are."""

from dataclasses import dataclass

import numpy as np

from reflowshock.meshing.board.pads import lift
from reflowshock.meshing.board.parameters import Board, Package, Warpage
from reflowshock.meshing.board.plan import Interval, package_plan

MERGE = 1.0e-9  # m: grid lines nearer than this are one
STEPS = 30  # of the search for the point that was displaced to a place; each gains the digits of the strain
EXACT = 1.0e-15  # m


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


@dataclass(frozen=True, slots=True, eq=False)
class PackageSide:
    """The underside of the package.

    Attributes:
        level: its height over the board's top face where it is not displaced [m].
        displacement: (m, n, 3) of its nodes, relative to the board's top face [m].
        above: the same of the planes of nodes in the substrate, upwards.
    """

    level: float
    displacement: StructuredFace
    above: tuple[tuple[float, StructuredFace], ...] = ()

    @classmethod
    def of_nodes(cls, points: np.ndarray, displacement: np.ndarray) -> "PackageSide":
        """Make it of the nodes of its facets, or of all of the substrate.

        Args:
            points: (k, 3) before they are displaced [m].
            displacement: (k, 3) [m].

        Raises:
            NotStructuredError: the nodes of a plane are no grid.
        """
        levels, plane = np.unique(np.round(points[:, 2] / MERGE), return_inverse=True)
        planes = [plane == number for number in range(len(levels))]
        faces = [
            (float(points[own, 2].mean()), StructuredFace.of_nodes(points[own], displacement[own])) for own in planes
        ]
        return cls(*faces[0], tuple(faces[1:]))

    @classmethod
    def prescribed(cls, package: Package, board: Board, warpage: Warpage) -> "PackageSide":
        """Make it of the package's plan and a prescribed lift."""
        plan = package_plan(package, board)
        x, y = _lines(plan.x), _lines(plan.y)
        displacement = np.zeros((len(x), len(y), 3))
        displacement[:, :, 2] = lift(package, warpage, x[:, None], y[None, :])
        face, level, substrate = StructuredFace(x, y, displacement), underside(package), package.substrate
        planes = level + substrate.thickness * np.arange(1, substrate.elements + 1) / substrate.elements
        return cls(level, face, tuple((float(plane), face) for plane in planes))

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height (k,) over the board's top face at points (k,), (k,) [m]; errors as ``origin``."""
        origin = self.origin(x, y)
        return self.level + self.displacement(origin[:, 0], origin[:, 1])[:, 2]

    def origin(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the points (k, 2) of the underside that were displaced to (k,), (k,) [m].

        Each facet is the bilinear image of a rectangle: the point X that was displaced to (x, y) is found by
        X <- (x, y) - u(X), which contracts by the strain.

        Raises:
            NotStructuredError: a point lies beyond the package.
        """
        place = np.column_stack([x, y])
        origin = place
        for _ in range(STEPS):
            found = self.displacement(origin[:, 0], origin[:, 1])
            before, origin = origin, place - found[:, :2]
            if np.abs(origin - before).max() < EXACT:
                break
        return origin

    def displaced(self, points: np.ndarray) -> np.ndarray:
        """Return where points (k, 3) of the substrate are after its displacement, linear between its nodes [m].

        Raises:
            NotStructuredError: a point lies beyond the package.
        """
        faces = ((self.level, self.displacement), *self.above)
        levels = np.array([level for level, _ in faces])
        (layer, share), x, y = _cell(levels, points[:, 2], "z"), points[:, 0], points[:, 1]
        moves = np.array([face(x, y) for _, face in faces])
        each, share = np.arange(len(points)), share[:, None]
        return points + (1.0 - share) * moves[layer, each] + share * moves[layer + 1, each]


def underside(package: Package) -> float:
    """Return the height of the undisplaced underside over the board's top face [m]: of the copper's plate, if any."""
    return package.standoff + (1 if package.copper.layout == "plate" else 2) * package.copper.thickness


def _lines(axis: tuple[Interval, ...]) -> np.ndarray:
    """Return all grid lines of an axis, each once [m]."""
    return np.concatenate([axis[0].lines(), *(part.lines()[1:] for part in axis[1:])])
