"""Energy of the mean strains of elements; the rest of the strain energy is the hourglass energy."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import CHUNK, Elements, classes, element_geometry
from reflowshock.fem.elements.stress import mean_strain


@dataclass(frozen=True, slots=True)
class MeanStrain:
    """Mean strains of elements, with one entry per class of equal shape and material.

    Attributes:
        cells: Nodes of each element, shape (ne, k) int32.
        shape: Class of each element, shape (ne,) int32.
        gradient: Mean gradients of the shape functions of each class, shape (ns, k, 3) [1/m].
        rigidity: Volume times elasticity of each class, shape (ns, 6, 6) [J].
    """

    cells: NDArray[np.int32]
    shape: NDArray[np.int32]
    gradient: NDArray[np.float64]
    rigidity: NDArray[np.float64]

    @classmethod
    def of(cls, elements: Elements) -> "MeanStrain | None":
        """Return the mean strains of elements with hourglass control, or None for elements without it."""
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
