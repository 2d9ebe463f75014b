"""The layers of solder at the pads, of a thickness that no mesh changes, as weights of integration points."""

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
    """Solder elements in the layers, in input numbers.

    Attributes:
        cells: ``(k,)``.
        slot: ``(k,)`` end times joints plus joint; end 0 is at the board, 1 at the package.
        weight: ``(k, 8)`` [m^3] the part of each octant inside the layer; octants in the order of the Gauss points.
        volume: ``(2 joints,)`` [m^3] of whole layers, of all models.
    """

    cells: NDArray[np.integer]
    slot: NDArray[np.int64]
    weight: NDArray[np.float64]
    volume: NDArray[np.float64]

    def within(self, cell_number: NDArray[np.int32]) -> "PadLayer":
        """Return what a model has, in its numbers of cells ``(ne,)``, -1 for those of another one."""
        cells = cell_number[self.cells]
        here = cells >= 0
        return PadLayer(cells[here], self.slot[here], self.weight[here], self.volume)


def octant_volumes(
    corners: NDArray[np.float64], centre: NDArray[np.float64], inward: NDArray[np.float64], thickness: float
) -> NDArray[np.float64]:
    """Return the volume of each octant of hexahedra between a plane and its parallel, exact for plane faces.

    Args:
        corners: ``(m, 8, 3)`` [m], tensor order.
        centre: ``(3,)`` [m] a point of the plane.
        inward: ``(3,)`` unit normal towards the parallel.
        thickness: Distance of both [m].

    Returns:
        ``(m, 8)`` [m^3].
    """
    octants = np.einsum("la,mai->mli", shape_functions(LATTICE), corners)[:, OCTANT]
    tetrahedra = octants[:, :, TETRAHEDRA]
    volume = np.abs(np.linalg.det(tetrahedra[..., 1:, :] - tetrahedra[..., :1, :])) / 6.0
    height = (tetrahedra - centre) @ inward
    inside = fraction_below(height, thickness) - fraction_below(height, 0.0)
    return np.asarray((volume * inside).sum(axis=2))


def fraction_below(height: NDArray[np.float64], level: float) -> NDArray[np.float64]:
    """Return the fraction ``(...)`` of tetrahedra with vertices at heights ``(..., 4)`` below a level."""
    low = np.sort(height, axis=-1) - level
    count = (low <= 0.0).sum(axis=-1)

    def cut(i: int, j: int) -> NDArray[np.float64]:
        """Return where the level cuts the edge from vertex i, as a fraction."""
        length = low[..., j] - low[..., i]
        return -low[..., i] / np.where(length > 0.0, length, 1.0)

    one = cut(0, 1) * cut(0, 2) * cut(0, 3)
    s, t, u, v = cut(0, 2), cut(0, 3), cut(1, 2), cut(1, 3)
    two = s * t * (1.0 - v) + s * v * (1.0 - u) + u * v
    three = 1.0 - (1.0 - cut(0, 3)) * (1.0 - cut(1, 3)) * (1.0 - cut(2, 3))
    return np.choose(count, [np.zeros_like(one), one, two, three, np.ones_like(one)])
