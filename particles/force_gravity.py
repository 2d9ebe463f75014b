"""Gravity as a force on the surface: the weight of an incompressible body is a hydrostatic load on its boundary."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from particles.body import Body
from particles.surface_measure import wall_corners

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Gravity:
    """Hydrostatic load -rho g z along the volume gradient.

    The weight m g of each particle would leave the statics to the interior operator (1 % in height).

    Attributes:
        weight: rho g, weight of the unit volume [N/m^3].
    """

    weight: float

    def energy(self, body: Body) -> float:
        """Potential energy rho g times the integral of z over the body [J], by the divergence theorem.

        The integral of z^2 / 2 n_z over the free surface and over the walls, exact for flat triangles.
        """
        walls = [wall_corners(body.points, *on_wall) for on_wall in zip(body.cloud.rings, body.plates, strict=True)]
        corners = np.concatenate([body.points[body.triangles], *walls])
        doubled_area_z = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
        z = corners[:, :, 2]
        mean_square = (z.sum(axis=1) ** 2 + (z**2).sum(axis=1)) / 12.0
        return self.weight * 0.25 * float((mean_square * doubled_area_z).sum())

    def force(self, body: Body) -> Floats:
        """Force -rho g z dV/dx, `(n, 3)` [N]: the gradient of the energy to second order in the spacing."""
        return -self.weight * body.points[:, 2:3] * body.volume()[1]
