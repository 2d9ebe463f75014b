"""Conservative surface forces as energy gradients: surface tension, gravity and wall adhesion.

The weight of an incompressible body is a hydrostatic load on its boundary; wetting a wall lowers the energy by
gamma cos(theta) per unit area.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.surface_measure import (
    area_gradient,
    area_vector,
    cotangent_laplacian,
    surface_area,
    wall_corners,
)
from reflowshock.particles.core.symmetry import fold
from reflowshock.particles.discretisation.discretisation import Discretisation
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.physics import BodyForce, Force, Physics
from reflowshock.particles.surface.contact_line import ContactLine


@dataclass(frozen=True, slots=True)
class SurfaceTension:
    """Energy E = gamma A of the free surface.

    Attributes:
        coefficient: Surface tension gamma [N/m].
    """

    coefficient: float

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """Add the force and its semi-implicit operator to the physics."""
        tension = cls(solder.surface_tension)
        return replace(physics, forces=(*physics.forces, tension), operators=(*physics.operators, tension))

    def energy(self, body: Body) -> float:
        """Return the surface energy [J]."""
        return self.coefficient * surface_area(body.points, body.triangles)

    def force(self, body: Body) -> Floats:
        """Return the force -dE/dx = -gamma K x, shape (n, 3) [N]."""
        return -self.coefficient * area_gradient(body.points, body.triangles)

    def matrix(self, body: Body, _space: Discretisation, time_step: float) -> sparse.csr_matrix:
        """Return the semi-implicit matrix dt gamma K, shape (3 n, 3 n) [kg/s]; the new force is f - dt gamma K v."""
        stiffness = self.coefficient * cotangent_laplacian(body.points, body.triangles, len(body.points))
        return sparse.kron(sparse.identity(3), time_step * stiffness, format="csr")


@dataclass(frozen=True, slots=True)
class Gravity(BodyForce):
    """Gravity as the potential energy of the volume inside the tracked surface.

    Weights m g of the particles would make the equilibrium depend on the interior operator (1 % error in height).

    Attributes:
        weight: Specific weight rho g [N/m^3].
    """

    weight: float

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """Add the force to the physics."""
        return replace(physics, forces=(*physics.forces, cls(solder.density * solder.gravity)))

    def energy(self, body: Body) -> float:
        """Return the potential energy, rho g times the integral of z over the body [J].

        By the divergence theorem this is the integral of z^2 / 2 n_z over free surface and walls, exact for flat
        triangles.
        """
        return self.weight * self._potential(body)[0]

    def force(self, body: Body) -> Floats:
        """Return the force -dE/dx, shape (n, 3) [N], the exact gradient of the discrete energy.

        The hydrostatic load -rho g z dV/dx agrees to second order in the spacing, but a step along it may raise the
        energy, so that a flat film never comes to rest.
        """
        return -self.weight * self._potential(body)[1]

    def hydrostatic_pressure(self, points: Floats) -> Floats:
        """Return the pressure -rho g z, zero at the height of the origin, shape (n,) [Pa]."""
        return -self.weight * points[:, 2]

    def _potential(self, body: Body) -> tuple[float, Floats]:
        """Return the integral of z over the body [m^4] and its gradient, shape (n, 3) [m^3]."""
        total, gradient = _potential_and_gradient(body.points, body.triangles)
        for ring, plate in zip(body.cloud.rings, body.plates, strict=True):
            corners = wall_corners(body.points, ring, plate)
            fan = np.arange(corners.shape[0] * 3, dtype=np.int32).reshape(-1, 3)
            on_wall, by_corner = _potential_and_gradient(corners.reshape(-1, 3), fan)
            total += on_wall
            gradient[ring] += _by_vertex(by_corner.reshape(-1, 3, 3), plate.side)
        return total, gradient


def _by_vertex(by_corner: Floats, side: float) -> Floats:
    """Convert a gradient by the corners of ``wall_corners``, shape (k, 3, 3), to one by line vertices, shape (k, 3)."""
    vertex, successor = (1, 2) if side > 0.0 else (2, 1)
    centre = by_corner[:, 0].sum(axis=0) / len(by_corner)
    return by_corner[:, vertex] + np.roll(by_corner[:, successor], 1, axis=0) + centre


@njit(cache=True)
def _potential_and_gradient(points, triangles):
    """Return the integral of z^2 / 2 n_z over flat triangles [m^4] and its gradient, shape (n, 3) [m^3]."""
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
class Wetting:
    """Energy E = -gamma cos(theta) A_wet of the wetted walls (the functional of Brakke's Surface Evolver).

    Attributes:
        coefficient: Surface tension gamma [N/m].
        lines: Contact lines with the contact angle at each vertex.
        others: All other surface forces; their balance gives the contact angle at a pinned vertex.
    """

    coefficient: float
    lines: Sequence[ContactLine]
    others: Sequence[Force]

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """Add the force and the events of the contact lines; all other forces must be present."""
        wetting = cls(solder.surface_tension, physics.lines, physics.forces)
        return replace(physics, forces=(*physics.forces, wetting), events=(*physics.events, wetting))

    def energy(self, body: Body) -> float:
        """Return the energy of the wetted walls [J], relative to contact lines at the edges of the pads."""
        return -self.coefficient * sum(line.cosine_area(body) for line in self.lines)

    def force(self, body: Body) -> Floats:
        """Return the force -dE/dx, shape (n, 3) [N]: gamma cos(theta) dA_wet/dx on contact lines of one angle."""
        force = np.zeros_like(body.points)
        for line in self.lines:
            ring = body.cloud.rings[line.wall]
            force[ring] += self.coefficient * line.cosine_area_gradient(body)
        return force

    def contact_cosines(self, body: Body) -> list[Floats]:
        """Compute the cosines of the contact angles at the vertices of each contact line, by the balance of forces."""
        load = self._load(body)
        return [line.contact_cosine(body, load, self.coefficient) for line in self.lines]

    def update(self, body: Body) -> None:
        """Release or pin vertices at the edges of the pads."""
        lines = [line for line in self.lines if line.has_events]
        if not lines:
            return
        load = self._load(body)
        for line in lines:
            line.update(body, load, self.coefficient)

    def attempt(self, body: Body) -> bool:
        """Snap vertices close to a pinning edge onto it; return whether any moved.

        This raises the energy; it is kept only if the next step lowers the energy by more.
        """
        lines = [line for line in self.lines if line.has_edge]
        if not lines:
            return False
        load, has_moved = self._load(body), False
        for line in lines:
            near = line.near_edges(body, load, self.coefficient)
            if near.any():
                line.catch(body, near)
                has_moved = True
        return has_moved

    def _load(self, body: Body) -> Floats:
        """Return all forces except wetting, shape (n, 3) [N], including the mean capillary pressure of the surface.

        The pressure p is the least-squares solution of f + p a = 0 over the vertices off the contact lines. The
        pressure of the solver would add the accelerations of a violent start to the contact angle.
        """
        force = sum((other.force(body) for other in self.others), np.zeros_like(body.points))
        force, gradient = fold(body.cloud, force), fold(body.cloud, body.volume()[1])
        off_lines = np.arange(len(body.points)) < body.cloud.surface_count
        off_lines[body.cloud.wall >= 0] = False
        a = gradient[off_lines]
        pressure = -float((force[off_lines] * a).sum() / (a**2).sum())
        return force + pressure * gradient
