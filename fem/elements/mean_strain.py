"""Energy of the mean strains of elements: what is left of the strain energy is the hourglass control's.

The hourglass energy in the balance is what the mean strains do not hold.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import CHUNK, Elements, classes, element_geometry
from reflowshock.fem.elements.stress import mean_strain


@dataclass(frozen=True, slots=True)
class MeanStrain:
    """The one-point part of elements, one entry a shape and material.

    Attributes:
        cells: ``(ne, k)`` int32.
        shape: ``(ne,)`` int32, class of each element.
        gradient: ``(ns, k, 3)`` [1/m] mean gradients.
        rigidity: ``(ns, 6, 6)`` [J] volume times elasticity.
    """

    cells: NDArray[np.int32]
    shape: NDArray[np.int32]
    gradient: NDArray[np.float64]
    rigidity: NDArray[np.float64]

    @classmethod
    def of(cls, elements: Elements) -> "MeanStrain | None":
        """Return the mean strains of elements with hourglass control, None for elements without."""
        if not elements.kind.hourglass:
            return None
        first, shape = classes(elements)
        geometry = element_geometry(elements.points, elements.cells[first])
        rigidity = geometry.volume[:, None, None] * elements.elasticity[elements.material[first]]
        return cls(elements.cells, shape, geometry.gradient, rigidity)

    def energy(self, displacement: NDArray[np.float64]) -> float:
        """Return the sum of V strain . C strain / 2 [J] at a displacement ``(n, 3)`` [m]."""
        total = 0.0
        for start in range(0, len(self.cells), CHUNK):
            cells, shape = self.cells[start : start + CHUNK], self.shape[start : start + CHUNK]
            strain = mean_strain(self.gradient[shape], displacement[cells])
            total += 0.5 * float(np.einsum("mi,mij,mj->", strain, self.rigidity[shape], strain, optimize=True))
        return total
