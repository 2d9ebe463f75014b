"""Layers of solder at the pads with a mesh-independent thickness, as weights of integration points."""

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.kernels.hexahedron import SIDES
from reflowshock.fem.mesh.point_shares import shape_functions

LATTICE = np.array([[i, j, k] for k in (-1, 0, 1) for j in (-1, 0, 1) for i in (-1, 0, 1)], dtype=float)
OCTANT = ((SIDES[:, None, :] + SIDES[None, :, :]) / 2 + 1).astype(int) @ np.array([1, 3, 9])  # its nodes in the lattice
# A cube in six tetrahedra around its diagonal: one for each order in which a path from corner 0 to 7 takes the axes.
TETRAHEDRA = np.array([(0, 1 << first, 7 - (1 << last), 7) for first, _, last in permutations(range(3))])


@dataclass(frozen=True, slots=True)
class PadLayer:
    """Solder elements in the pad layers, in input numbers.

    Attributes:
        cells: Elements that intersect a layer, shape (k,).
        slot: Layer of each, end * joints + joint, where end 0 is the board and end 1 the package, shape (k,).
        weight: Volume of each octant inside the layer, octants in the order of the Gauss points, shape (k, 8) [m^3].
        volume: Volumes of the whole layers over all models, shape (2 joints,) [m^3].
    """

    cells: NDArray[np.integer]
    slot: NDArray[np.int64]
    weight: NDArray[np.float64]
    volume: NDArray[np.float64]

    def within(self, cell_number: NDArray[np.int32]) -> "PadLayer":
        """Return the part of one model in its own numbers.

        Args:
            cell_number: Cell number in the model of each input cell, -1 if it belongs to another, shape (ne,).
        """
        cells = cell_number[self.cells]
        here = cells >= 0
        return PadLayer(cells[here], self.slot[here], self.weight[here], self.volume)


def octant_volumes(
    corners: NDArray[np.float64], centre: NDArray[np.float64], inward: NDArray[np.float64], thickness: float
) -> NDArray[np.float64]:
    """Return the volume of each octant of hexahedra between two parallel planes, exact for plane faces.

    Args:
        corners: Node coordinates in tensor order, shape (m, 8, 3) [m].
        centre: Point of the first plane, shape (3,) [m].
        inward: Unit normal towards the second plane, shape (3,).
        thickness: Distance between both planes [m].

    Returns:
        Volumes of the octants, shape (m, 8) [m^3].
    """
    octants = np.einsum("la,mai->mli", shape_functions(LATTICE), corners)[:, OCTANT]
    tetrahedra = octants[:, :, TETRAHEDRA]
    volume = np.abs(np.linalg.det(tetrahedra[..., 1:, :] - tetrahedra[..., :1, :])) / 6.0
    height = (tetrahedra - centre) @ inward
    inside = fraction_below(height, thickness) - fraction_below(height, 0.0)
    return np.asarray((volume * inside).sum(axis=2))


def fraction_below(height: NDArray[np.float64], level: float) -> NDArray[np.float64]:
    """Return the fraction of the volume of tetrahedra that lies below a level, shape (...), from 0 to 1.

    Args:
        height: Heights of the four vertices, shape (..., 4), in the unit of ``level``.
        level: Height of the horizontal plane.
    """
    low = np.sort(height, axis=-1) - level
    count = (low <= 0.0).sum(axis=-1)

    def cut(i: int, j: int) -> NDArray[np.float64]:
        """Return the fraction of the edge from vertex i to j at which the level cuts it."""
        length = low[..., j] - low[..., i]
        return -low[..., i] / np.where(length > 0.0, length, 1.0)

    below_one = cut(0, 1) * cut(0, 2) * cut(0, 3)
    s, t, u, v = cut(0, 2), cut(0, 3), cut(1, 2), cut(1, 3)
    two = s * t * (1.0 - v) + s * v * (1.0 - u) + u * v
    three = 1.0 - (1.0 - cut(0, 3)) * (1.0 - cut(1, 3)) * (1.0 - cut(2, 3))
    return np.choose(count, [np.zeros_like(below_one), below_one, two, three, np.ones_like(below_one)])
