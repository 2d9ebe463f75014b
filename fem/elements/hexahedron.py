"""Fully integrated 8-node hexahedron with incompatible modes; nodes in tensor order."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.kind import Geometry
from reflowshock.fem.kernels import hexahedron as kernels_hexahedron


@dataclass(frozen=True, slots=True)
class IncompatibleModes:
    """Hexahedron with incompatible modes, the default; see ``kernels.hexahedron.stiffness``."""

    name: str = "incompatible_modes"
    nodes: int = 8
    hourglass: bool = False

    def geometry(self, corners: NDArray[np.float64]) -> Geometry:
        """Integrate at 2 x 2 x 2 Gauss points; nodal volumes are integrals of the shape functions."""
        nodal_volume, gradient = np.empty((len(corners), 8)), np.empty((len(corners), 8, 3))
        lowest = kernels_hexahedron.geometry(corners, nodal_volume, gradient)
        return Geometry(nodal_volume, gradient, lowest)

    def stiffness(
        self, corners: NDArray[np.float64], elasticity: NDArray[np.float64], material: NDArray[np.int32]
    ) -> NDArray[np.float64]:
        """Return the stiffness ``(ne, 24, 24)`` [N/m] with the incompatible modes condensed."""
        result = np.empty((len(corners), 24, 24))
        kernels_hexahedron.stiffness(corners, elasticity, material, result)
        return result


HEXAHEDRON = IncompatibleModes()
