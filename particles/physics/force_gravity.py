"""Gravity as a force on the surface: the weight of an incompressible body is a hydrostatic load on its boundary."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.surface_measure import area_vector, wall_corners


@njit(cache=True)
def _potential_and_gradient(points, triangles):
    """Integral of z^2 / 2 n_z over flat triangles [m^4], and its gradient `(n, 3)` [m^3]."""
    total, gradient = 0.0, np.zeros(points.shape)
    for t in range(triangles.shape[0]):
        i, j, m = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        doubled_area_z = area_vector(points, i, j, m)[2]
        first = points[i, 2] + points[j, 2] + points[m, 2]
        second = points[i, 2] ** 2 + points[j, 2] ** 2 + points[m, 2] ** 2
        quarter_mean = (first * first + second) / 48.0
        total += quarter_mean * doubled_area_z
        for k in range(3):
            a, b, c = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            gradient[a, 0] += quarter_mean * (points[b, 1] - points[c, 1])
            gradient[a, 1] += quarter_mean * (points[c, 0] - points[b, 0])
            gradient[a, 2] += (first + points[a, 2]) / 24.0 * doubled_area_z
    return total, gradient


@dataclass(frozen=True, slots=True)
class Gravity:
    """Potential energy of the weight in the tracked surface.

    The weight m g of each particle would leave the statics to the interior operator (1 % in height).

    Attributes:
        weight: rho g, weight of the unit volume [N/m^3].
    """

    weight: float

    def energy(self, body: Body) -> float:
        """Potential energy rho g times the integral of z over the body [J], by the divergence theorem.

        The integral of z^2 / 2 n_z over the free surface and over the walls, exact for flat triangles.
        """
        return self.weight * self._potential(body)[0]

    def force(self, body: Body) -> Floats:
        """Force -dE/dx, `(n, 3)` [N], of this very energy.

        The hydrostatic load -rho g z dV/dx is the same to second order in the spacing; but where it differs, a step
        along it may raise the energy, and a flat film never rests.
        """
        return -self.weight * self._potential(body)[1]

    def _potential(self, body: Body) -> tuple[float, Floats]:
        """Integral of z over the body [m^4] and its gradient `(n, 3)` [m^3]."""
        total, gradient = _potential_and_gradient(body.points, body.triangles)
        for ring, plate in zip(body.cloud.rings, body.plates, strict=True):
            corners = wall_corners(body.points, ring, plate)
            fan = np.arange(corners.shape[0] * 3, dtype=np.int32).reshape(-1, 3)
            on_wall, by_corner = _potential_and_gradient(corners.reshape(-1, 3), fan)
            total += on_wall
            gradient[ring] += _by_vertex(by_corner.reshape(-1, 3, 3), plate.side)
        return total, gradient


def _by_vertex(by_corner: Floats, side: float) -> Floats:
    """Gradient by the vertices of a contact line `(k, 3)` of that by the corners of `wall_corners` `(k, 3, 3)`."""
    own, after = (1, 2) if side > 0.0 else (2, 1)
    centre = by_corner[:, 0].sum(axis=0) / len(by_corner)
    return by_corner[:, own] + np.roll(by_corner[:, after], 1, axis=0) + centre
