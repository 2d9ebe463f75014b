"""The package's underside where the shock has it: displaced, and bilinear between its nodes as its facets are."""

from dataclasses import dataclass

import numpy as np

from reflowshock.meshing.board.pads import lift
from reflowshock.meshing.board.parameters import Board, Package, Warpage
from reflowshock.meshing.board.plan import Interval, package_plan
from reflowshock.meshing.core.structured_face import StructuredFace

STEPS = 30  # of the search for the point that was displaced to a place; each gains the digits of the strain
EXACT = 1.0e-15  # m


@dataclass(frozen=True, slots=True, eq=False)
class PackageSide:
    """The underside of the package.

    Attributes:
        level: its height over the board's top face where it is not displaced [m].
        displacement: (m, n, 3) of its nodes, relative to the board's top face [m].
    """

    level: float
    displacement: StructuredFace

    @classmethod
    def of_nodes(cls, points: np.ndarray, displacement: np.ndarray) -> "PackageSide":
        """Make it of the nodes of its facets.

        Args:
            points: (k, 3) before they are displaced [m].
            displacement: (k, 3) [m].

        Raises:
            NotStructuredError: the nodes are no grid.
        """
        return cls(float(points[:, 2].mean()), StructuredFace.of_nodes(points, displacement))

    @classmethod
    def prescribed(cls, package: Package, board: Board, warpage: Warpage) -> "PackageSide":
        """Make it of the package's plan and a prescribed lift."""
        plan = package_plan(package, board)
        x, y = _lines(plan.x), _lines(plan.y)
        displacement = np.zeros((len(x), len(y), 3))
        displacement[:, :, 2] = lift(package, warpage, x[:, None], y[None, :])
        return cls(underside(package), StructuredFace(x, y, displacement))

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height (k,) over the board's top face at points (k,), (k,) [m].

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
        return self.level + found[:, 2]


def underside(package: Package) -> float:
    """Return the height of the undisplaced underside over the board's top face [m]: of the copper's plate, if any."""
    return package.standoff + (1 if package.copper.layout == "plate" else 2) * package.copper.thickness


def _lines(axis: tuple[Interval, ...]) -> np.ndarray:
    """Return all grid lines of an axis, each once [m]."""
    return np.concatenate([axis[0].lines(), *(part.lines()[1:] for part in axis[1:])])
